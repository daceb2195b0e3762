// [domain], [time], [solver], [contact], [parallel] and [output].

#include "case_sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cairn/material/variables.hpp"
#include "case_names.hpp"

namespace cairn::reading {
namespace {

constexpr int most_cells = 1'000'000;  // in one direction
constexpr std::int64_t most_steps = std::numeric_limits<std::int64_t>::max();

/// Cells from their number or their size; false after an error.
bool read_cells(Table& table, Domain& d) {
  const bool by_count = table.has("cells"), by_size = table.has("cell_size");
  // An override of one wins over the other in the file.
  const bool count_overridden = table.where("cells").is_override(),
             size_overridden = table.where("cell_size").is_override();
  if (!by_count && !by_size) {
    table.missing("cells", "is missing; give the number of cells or cell_size");
    return false;
  }
  if (by_count && by_size && count_overridden == size_overridden) {
    table.error("cell_size", "is given beside cells; give one of the two");
    return false;
  }
  const bool use_count = by_count && (!by_size || count_overridden);
  const std::string_view key = use_count ? "cells" : "cell_size";
  const std::size_t before = table.error_count();
  const Vec3 value = table.scalar_or_vector(key, d.dimension, use_count ? Range{1, most_cells} : positive);
  if (table.error_count() != before) return false;
  for (int k = 0; k < d.dimension; ++k) {
    const double length = d.upper[k] - d.lower[k], count = use_count ? value[k] : length / value[k];
    const double whole = std::max(1.0, std::round(count));
    std::string problem;
    if (!(std::abs(count - whole) <= (use_count ? 0 : 1e-6 * whole)))
      problem = use_count ? fmt::format("{} is not a whole number of cells", value[k])
                          : fmt::format(
                                "{} does not divide the length {:.12g} in direction {} into whole cells; {:.12g} does",
                                value[k], length, "xyz"[k], length / whole);
    if (whole > most_cells)
      problem = fmt::format("gives {:.6g} cells in direction {}; must be in [1, {}]", whole, "xyz"[k], most_cells);
    if (!problem.empty()) {
      table.error(key, problem);
      return false;
    }
    d.cells[k] = static_cast<int>(whole);
  }
  return true;
}

/// A table that is given replaces the default; an empty one means never.
void read_schedule(Table& table, Schedule& schedule) {
  if (!table.present()) return;
  schedule.every = table.has("every") ? table.integer("every", std::nullopt, 1, most_steps) : 0;
  schedule.interval = table.has("interval") ? table.number("interval", std::nullopt, positive) : 0;
  schedule.interval_wall = table.has("interval_wall") ? table.number("interval_wall", std::nullopt, positive) : 0;
}

/// What particle files can hold: what every point has, and the variables of the laws.
std::vector<std::string_view> known_fields() {
  std::vector<std::string_view> names(std::begin(particle_fields), std::end(particle_fields));
  for (const std::string_view variable : law_variables())
    if (std::ranges::find(names, variable) == names.end()) names.push_back(variable);
  return names;
}

void read_fields(Table& table, Schedule& schedule) {
  schedule.fields.assign(std::begin(particle_fields), std::begin(particle_fields) + default_particle_fields);
  if (!table.has("fields")) return;
  schedule.fields.clear();
  for (const auto& name : table.texts("fields")) {
    if (name == "position") continue;  // always written
    const auto known = known_fields();
    if (std::ranges::find(known, std::string_view(name)) == known.end()) {
      table.error("fields", fmt::format("{} is not a choice; choose from {}", in_quotes(name), listed(known)));
    } else if (std::ranges::find(schedule.fields, name) != schedule.fields.end()) {
      table.error("fields", fmt::format("{} is listed twice; list it once", in_quotes(name)));
    } else {
      schedule.fields.push_back(name);
    }
  }
}

/// Index of the material of one side of a pair; nothing after an error.
std::optional<int> pair_side(Table& table, const std::vector<Material>& materials, const std::string& name) {
  const int found = find_material(materials, name);
  if (found >= 0 && name == "wall") {
    table.error("materials",
                "\"wall\" is a material here, and the word for the faces of type wall; name the material "
                "otherwise");
    return std::nullopt;
  }
  if (found >= 0 || name == "wall") return found;
  table.error("materials",
              fmt::format("{} is not a material; known are {}, wall", in_quotes(name), material_list(materials)));
  return std::nullopt;
}

void read_pair(Table table, const std::vector<Material>& materials, ContactOptions& contact) {
  ContactPair pair;
  const bool has_friction = table.has("friction");
  pair.friction = table.number("friction", contact.friction, friction_range);
  pair.law = table.choice("law", contact_law_names, has_friction ? ContactLaw::friction : contact.law);
  if (table.has("law") && pair.law == ContactLaw::none && contact.law != ContactLaw::none)
    table.error("law",
                "\"none\" joins all bodies in one field and cannot hold for one pair; set contact.law or use stick");
  if (!table.has("materials")) table.missing("materials", "is missing; name two materials, or a material and \"wall\"");
  const auto names = table.texts("materials");
  table.finish();
  if (names.size() != 2) {
    if (!names.empty()) table.error("materials", fmt::format("names {} materials; must name two", names.size()));
    return;
  }
  const auto a = pair_side(table, materials, names[0]), b = pair_side(table, materials, names[1]);
  if (!a || !b) return;
  if (*a < 0 && *b < 0) return table.error("materials", "names two walls; walls do not touch each other");
  pair.material_a = *a;
  pair.material_b = *b;
  const auto same = [&](const ContactPair& other) {
    return std::minmax(other.material_a, other.material_b) == std::minmax(pair.material_a, pair.material_b);
  };
  if (std::ranges::any_of(contact.pairs, same))
    return table.error("materials", "this pair has been given above; give it once");
  contact.pairs.push_back(pair);
}

/// Large patches share fewer nodes; small domains need small ones, so that several ranks have work.
int default_patch_cells(const Domain& domain, int dimension) {
  const double large = dimension == 2 ? 64 : 24, small = dimension == 2 ? 32 : 16, enough = 16;
  double patches = 1;
  for (int k = 0; k < dimension; ++k) patches *= domain.cells[k] / large;
  return static_cast<int>(patches >= enough ? large : small);
}

}  // namespace

void read_domain(Table domain, Domain& d) {
  if (!domain.present()) return domain.missing("", "the table is missing; it needs at least upper and cells");
  d.dimension = static_cast<int>(domain.integer("dimension", 2, 2, 3));
  const int dim = d.dimension;
  const std::size_t before = domain.error_count();
  d.lower = domain.vector("lower", dim, Vec3::Zero().eval());
  d.upper = domain.vector("upper", dim, std::nullopt);
  bool ordered = domain.error_count() == before;
  for (int k = 0; k < dim && ordered; ++k) {
    ordered = d.upper[k] > d.lower[k];
    if (!ordered)
      domain.error("upper", fmt::format("{} is not above lower ({}) in direction {}; it must be greater", d.upper[k],
                                        d.lower[k], "xyz"[k]));
  }
  domain.has("cells");
  domain.has("cell_size");
  const bool counted = (ordered || !domain.has("cell_size")) && read_cells(domain, d);
  d.periodic = domain.booleans("periodic", dim);
  for (int k = 0; k < dim && counted; ++k)
    if (d.periodic[k] && d.cells[k] < 4)
      domain.error("periodic", fmt::format("direction {} has {} cells; a periodic direction needs at least 4", "xyz"[k],
                                           d.cells[k]));
  d.gravity = domain.motion("gravity", dim);
  domain.has("deform");  // read_deform
  d.patch_cells = static_cast<int>(domain.integer("patch_cells", default_patch_cells(d, dim), 4, 4096));
  domain.finish();
}

void read_time(Table time, bool staged, Time& result) {
  const bool until = time.has("until");
  if (!time.has("end") && !time.has("steps") && !until && !staged)
    time.missing("end", "is missing; give end (simulated time, s) or steps");
  if (time.has("end")) result.end = time.number("end", std::nullopt, positive);
  if (time.has("steps")) result.steps = time.integer("steps", std::nullopt, 1, most_steps);
  result.cfl = time.number("cfl", 0.4, {0, 1, true});
  result.dt = time.has("dt") ? time.number("dt", std::nullopt, positive) : 0;
  result.wall_limit = time.has("wall_limit") ? time.number("wall_limit", std::nullopt, positive) : 0;
  time.finish();
}

void read_solver(Table solver, int dimension, SolverOptions& result) {
  result.shape = solver.choice("shape", shape_function_names, ShapeFunction::gimp);
  result.stress_update = solver.choice("stress_update", stress_update_names, StressUpdate::both);
  result.flip = solver.number("flip", 1.0, {0, 1});
  // Points on linear hats gain energy from spin: a point's share of inertia jumps as it moves.
  result.spin = solver.boolean("spin", result.shape != ShapeFunction::linear);
  const int most = dimension == 2 ? 64 : 125;
  result.points_per_cell = static_cast<int>(solver.integer("points_per_cell", dimension == 2 ? 4 : 8, 1, most));
  const double side =
      std::round(dimension == 2 ? std::sqrt(result.points_per_cell) : std::cbrt(result.points_per_cell));
  if (static_cast<int>(dimension == 2 ? side * side : side * side * side) != result.points_per_cell)
    solver.error("points_per_cell", fmt::format("{} is not a {}; choose one of {}", result.points_per_cell,
                                                dimension == 2 ? "square number" : "cube number",
                                                dimension == 2 ? "1, 4, 9, 16, 25, 36, 49, 64" : "1, 8, 27, 64, 125"));
  result.motion = solver.choice("motion", motion_names, result.motion);
  if (result.motion == Motion::projected && result.stress_update != StressUpdate::both &&
      result.stress_update != StressUpdate::modified_last)
    solver.error("motion", "\"projected\" needs stress_update = \"both\" or \"modified_last\"");
  result.surface = solver.choice("surface", surface_names, result.surface);
  result.noise_filter = solver.choice("noise_filter", noise_filter_names, result.noise_filter);
  result.noise_order = static_cast<int>(solver.integer("noise_order", result.noise_order, 1, 20));
  result.lost_points = solver.choice("lost_points", lost_points_names, result.lost_points);
  result.energy_limit = solver.number("energy_limit", 0.0, not_negative);
  solver.finish();
}

void read_damping(Table damping, StressUpdate update, DampingOptions& result) {
  result.local = damping.number("local", 0.0, {0, 1, false, true});
  result.viscous = damping.number("viscous", 0.0, not_negative);
  result.relax = damping.boolean("relax", false);
  if (result.local > 0 && update != StressUpdate::both && update != StressUpdate::modified_last)
    damping.error("local", "needs solver.stress_update = \"both\" or \"modified_last\"");
  damping.finish();
}

void read_contact(Table contact, const std::vector<Material>& materials, ContactOptions& c) {
  c.law = contact.choice("law", contact_law_names, c.law);
  c.release = contact.choice("release", release_names, c.release);
  c.friction = contact.number("friction", c.friction, friction_range);
  // Who says how large a stand-off is wants one.
  c.gap = contact.choice("gap", gap_rule_names, contact.has("fill") ? GapRule::fill : GapRule::pressure);
  c.fill = contact.number("fill", c.fill, {0, 1});
  c.impulse_limit = contact.number("impulse_limit", c.impulse_limit, not_negative);
  c.normals = contact.choice("normals", normal_source_names, c.normals);
  c.normal_choice = contact.choice("normal_choice", normal_choice_names, c.normal_choice);
  c.gate = contact.choice("gate", gate_names, c.gate);
  c.departing_friction = contact.choice("departing_friction", departing_friction_names, c.departing_friction);
  c.passes = contact.choice("passes", passes_names, c.passes);
  c.separation = contact.number("separation", c.separation, not_negative);
  for (Table& pair : contact.tables("pair")) read_pair(std::move(pair), materials, c);
  contact.finish();
}

void read_parallel(Table parallel, ParallelOptions& result) {
  result.partition = parallel.choice("partition", partition_names, result.partition);
  result.balance_every = static_cast<int>(parallel.integer("balance_every", result.balance_every, 0, 1'000'000'000));
  result.imbalance = parallel.number("imbalance", result.imbalance, Range{1, infinity, false, false, false});
  parallel.finish();
}

void read_output(Table output, const Draft& draft, Output& result) {
  Table particles = output.table("particles");
  read_schedule(particles, result.particles);
  read_fields(particles, result.particles);
  particles.finish();
  Table checkpoint = output.table("checkpoint");
  read_schedule(checkpoint, result.checkpoint);
  result.checkpoint.keep = static_cast<int>(checkpoint.integer("keep", 2, 1, 1'000'000));
  checkpoint.finish();
  result.history.every = 10;
  const std::pair<std::string_view, Schedule*> plain[] = {{"grains", &result.grains},
                                                          {"contacts", &result.contacts},
                                                          {"forces", &result.forces},
                                                          {"tips", &result.tips},
                                                          {"history", &result.history}};
  for (const auto& [key, schedule] : plain) {
    Table table = output.table(key);
    read_schedule(table, *schedule);
    table.finish();
  }
  const auto has_tip = [](const CrackSpec& c) { return c.ends[0] == CrackEnd::tip || c.ends[1] == CrackEnd::tip; };
  if (result.tips.active() && std::ranges::none_of(draft.result.cracks, has_tip) && output.error_count() == 0)
    output.error("tips", "is for tips of cracks, and no crack has one");
  result.track = output.integers("track");
  check_ids(output, "track", result.track, draft);
  output.finish();
}

}  // namespace cairn::reading
