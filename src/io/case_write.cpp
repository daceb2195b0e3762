// The case as a file that reads back to the same case.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "cairn/material/registry.hpp"
#include "case_writer.hpp"

namespace cairn::reading {
namespace {

/// Writes the keys of a shape; the dimension decides the length of vectors.
struct KeyWriter {
  int dim;
  std::string all;
  void add(std::string_view key, const std::string& value) {
    all += fmt::format("{}{} = {}", all.empty() ? "" : ", ", key, value);
  }
  void vector(std::string_view key, const Vec3& v) { add(key, list_of(v, dim)); }
  void positive(std::string_view key, const Vec3& v) { add(key, list_of(v, dim)); }
  void positive(std::string_view key, double value) { add(key, text_of(value)); }
  void not_negative(std::string_view key, double value) { add(key, text_of(value)); }
  void angle(std::string_view key, double value) { add(key, text_of(value)); }
  void vectors(std::string_view key, const std::vector<Vec3>& list) {
    std::string points;
    for (const Vec3& p : list) points += (points.empty() ? "" : ", ") + list_of(p, dim);
    add(key, "[" + points + "]");
  }
  void text(std::string_view key, const std::string& value) { add(key, text_of(value)); }
  void file(std::string_view key, const ShapeFile& f) { add(key, text_of(f.copy)); }
  void placement(const Placement& p) {
    add("unit", text_of(p.unit)), add("scale", text_of(p.scale)), vector("move", p.move);
    add("rotate", dim == 3 ? list_of(p.rotate, 3) : text_of(p.rotate.z()));
  }
};

}  // namespace

std::string shape_text(const Shape& shape, int dim) {
  return std::visit(
      [&]<class S>(const S& s) -> std::string {
        if constexpr (std::is_same_v<S, Compound>) {
          std::string parts;
          for (const Shape& part : s.of) parts += (parts.empty() ? "" : ", ") + shape_text(part, dim);
          return fmt::format("{{ type = \"{}\", of = [{}] }}", name_of(compound_names, s.operation), parts);
        } else if constexpr (!std::is_same_v<S, LabelBody>) {
          KeyWriter keys{dim, fmt::format("type = \"{}\"", S::names.of(dim))};
          S::list(s, keys);
          return "{ " + keys.all + " }";
        } else {
          return {};  // comes from [[labels]]
        }
      },
      shape);
}

namespace {

void write_domain(Writer& out, const Domain& d) {
  out.section("[domain]");
  out.key("dimension", d.dimension);
  out.vector("lower", d.lower);
  out.vector("upper", d.upper);
  out.raw("cells", list_of(d.cells, d.dimension));
  out.raw("periodic", list_of(d.periodic, d.dimension));
  out.raw("gravity", Writer::table_of(d.gravity, 0, d.dimension));
  out.key("patch_cells", d.patch_cells);
  for (int k = 0; k < d.dimension; ++k)
    if (d.deformation.axes[k].active()) out.axis(fmt::format("deform.{}", "xyz"[k]), d.deformation.axes[k]);
}

void write_time_and_solver(Writer& out, const Time& time, const SolverOptions& solver) {
  out.section("[time]");
  if (std::isfinite(time.end)) out.key("end", time.end);
  if (time.steps != Time{}.steps) out.key("steps", time.steps);
  out.key("cfl", time.cfl);
  if (time.dt > 0) out.key("dt", time.dt);
  if (time.until.given()) out.raw("until", until_text(time.until));
  if (time.wall_limit > 0) out.key("wall_limit", time.wall_limit);
  out.section("[solver]");
  out.key("shape", name_of(shape_function_names, solver.shape));
  out.key("stress_update", name_of(stress_update_names, solver.stress_update));
  out.key("flip", solver.flip);
  out.key("motion", name_of(motion_names, solver.motion));
  out.key("spin", solver.spin);
  out.key("points_per_cell", solver.points_per_cell);
  out.key("surface", name_of(surface_names, solver.surface));
  out.key("noise_filter", name_of(noise_filter_names, solver.noise_filter));
  out.key("noise_order", solver.noise_order);
  out.key("lost_points", name_of(lost_points_names, solver.lost_points));
  out.key("energy_limit", solver.energy_limit);
}

void write_contact(Writer& out, const Case& c) {
  const ContactOptions& contact = c.contact;
  out.section("[contact]");
  out.key("law", name_of(contact_law_names, contact.law));
  out.key("release", name_of(release_names, contact.release));
  out.key("friction", contact.friction);
  out.key("gap", name_of(gap_rule_names, contact.gap));
  out.key("fill", contact.fill);
  out.key("impulse_limit", contact.impulse_limit);
  out.key("normals", name_of(normal_source_names, contact.normals));
  out.key("normal_choice", name_of(normal_choice_names, contact.normal_choice));
  out.key("gate", name_of(gate_names, contact.gate));
  out.key("departing_friction", name_of(departing_friction_names, contact.departing_friction));
  out.key("passes", name_of(passes_names, contact.passes));
  out.key("separation", contact.separation);
  const auto name = [&](int material) { return material < 0 ? "wall" : c.materials[material].name; };
  for (const auto& pair : contact.pairs) {
    out.section("[[contact.pair]]");
    out.raw("materials", fmt::format("[{}, {}]", text_of(name(pair.material_a)), text_of(name(pair.material_b))));
    out.key("law", name_of(contact_law_names, pair.law));
    out.key("friction", pair.friction);
  }
}

void write_parameters(Writer& out, const Material& material) {
  for (const auto& p : find_law(material.model)->parameters) {
    const auto value = [&](const std::string& key) { return material.parameters.at(key); };
    if (p.most == 0) {
      out.key(p.key, value(std::string(p.key)));
      continue;
    }
    std::vector<double> list;
    while (material.parameters.contains(list_key(p.key, std::ssize(list))))
      list.push_back(value(list_key(p.key, std::ssize(list))));
    out.raw(p.key, list_of(list, std::ssize(list)));
  }
}

void write_bodies(Writer& out, const Draft& draft) {
  const Case& c = draft.result;
  for (const auto& m : c.materials) {
    out.section("[materials." + key_of(m.name) + "]");
    out.key("model", m.model);
    out.key("density", m.density);
    if (c.domain.dimension == 2 && find_law(m.model)->has_plane_stress) out.key("plane", name_of(plane_names, m.plane));
    write_parameters(out, m);
  }
  for (std::size_t i = 0; i < draft.shaped_bodies; ++i) {
    const BodySpec& body = c.bodies[i];
    out.section("[[bodies]]");
    out.raw("shape", shape_text(body.shape, c.domain.dimension));
    out.key("material", c.materials[body.material].name);
    out.motion(body.velocity, body.angular_velocity);
    out.key("initial_pressure", body.initial_pressure);
    if (!body.group.empty()) out.key("group", body.group);
  }
  for (const auto& grains : draft.grains) {
    out.section("[[grains]]");
    out.key("file", grains.copy);
    if (grains.material >= 0) out.key("material", c.materials[grains.material].name);
    out.motion(grains.velocity, grains.angular_velocity);
    out.key("initial_pressure", grains.initial_pressure);
    if (!grains.group.empty()) out.key("group", grains.group);
  }
  for (const auto& labels : draft.labels) {
    out.section("[[labels]]");
    out.key("file", labels.copy);
    if (!labels.table.empty()) out.key("table", labels.table);
    if (labels.common.material >= 0) out.key("material", c.materials[labels.common.material].name);
    out.key("scale", labels.placement.scale);
    out.vector("move", labels.placement.move);
    const Vec3& turn = labels.placement.rotate;
    out.raw("rotate", c.domain.dimension == 3 ? list_of(turn, 3) : text_of(turn.z()));
    out.motion(labels.common.velocity, labels.common.angular_velocity);
    out.key("initial_pressure", labels.common.initial_pressure);
    if (!labels.common.group.empty()) out.key("group", labels.common.group);
  }
  for (const auto& insert : c.inserts) {
    out.section("[[insert]]");
    out.text(insert.text);
  }
  for (const auto& remove : c.removes) {
    out.section("[[remove]]");
    out.raw("region", shape_text(remove.region, c.domain.dimension));
    out.key("start", remove.start);
    if (std::isfinite(remove.end)) out.key("end", remove.end);
    out.key("every", remove.every);
  }
  for (const auto& drive : c.drives) {
    out.section("[[drive]]");
    if (drive.overlapping >= 0) {
      out.raw("bodies", fmt::format("{{ overlapping = \"{}\", within = {} }}", face_names[drive.overlapping],
                                    text_of(drive.within)));
    } else if (!drive.group.empty()) {
      out.raw("bodies", "{ group = " + text_of(drive.group) + " }");
    } else {
      out.raw("bodies", "{ ids = " + list_of(drive.ids, std::ssize(drive.ids)) + " }");
    }
    out.drive(drive);
  }
}

void write_boundary(Writer& out, const Case& c) {
  out.section("[boundary]");
  for (int i = 0; i < 2 * c.domain.dimension; ++i) {
    const Face& face = c.faces[i];
    if (face.type == FaceType::periodic) continue;
    out.face(face_names[i], face);
  }
}

void write_damping(Writer& out, const DampingOptions& damping) {
  out.section("[damping]");
  out.key("local", damping.local);
  out.key("viscous", damping.viscous);
  out.key("relax", damping.relax);
}

void write_stages(Writer& out, const std::vector<RunStage>& stages) {
  for (const RunStage& stage : stages) {
    out.section("[[stage]]");
    out.key("name", stage.name);
    if (stage.until.given()) out.raw("until", until_text(stage.until));
    if (!stage.set.empty()) out.raw("set", stage.set);
  }
}

void write_parallel(Writer& out, const ParallelOptions& parallel) {
  out.section("[parallel]");
  out.key("partition", name_of(partition_names, parallel.partition));
  out.key("balance_every", parallel.balance_every);
  out.key("imbalance", parallel.imbalance);
}

void write_schedule(Writer& out, std::string_view name, const Schedule& s, const std::string& more = {}) {
  std::vector<std::string> parts;
  if (s.every > 0) parts.push_back("every = " + text_of(s.every));
  if (s.interval > 0) parts.push_back("interval = " + text_of(s.interval));
  if (s.interval_wall > 0) parts.push_back("interval_wall = " + text_of(s.interval_wall));
  if (!more.empty()) parts.push_back(more);
  out.raw(name, parts.empty() ? "{}" : fmt::format("{{ {} }}", fmt::join(parts, ", ")));
}

void write_output(Writer& out, const Output& o) {
  out.section("[output]");
  write_schedule(out, "particles", o.particles,
                 "fields = " + list_of(o.particles.fields, std::ssize(o.particles.fields)));
  write_schedule(out, "grains", o.grains);
  write_schedule(out, "contacts", o.contacts);
  write_schedule(out, "forces", o.forces);
  write_schedule(out, "tips", o.tips);
  write_schedule(out, "history", o.history);
  write_schedule(out, "checkpoint", o.checkpoint, "keep = " + text_of(o.checkpoint.keep));
  out.raw("track", list_of(o.track, std::ssize(o.track)));
}

}  // namespace

std::string write_case(const Draft& draft) {
  const Case& c = draft.result;
  Writer out(c.domain.dimension);
  out.key("title", c.title);
  write_domain(out, c.domain);
  write_time_and_solver(out, c.time, c.solver);
  write_contact(out, c);
  write_bodies(out, draft);
  write_cracks(out, c);
  write_boundary(out, c);
  write_damping(out, c.damping);
  write_stages(out, c.stages);
  write_parallel(out, c.parallel);
  write_output(out, c.output);
  return out.take();
}

}  // namespace cairn::reading
