// What moves by its own rule: [[drive]] and the faces of [boundary].

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cairn/material/registry.hpp"
#include "case_names.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

/// Reads one way of selecting bodies, from the drive itself or from its table `bodies`; adds how many were given.
void read_selection(Table& table, const Draft& draft, Drive& drive, int& given) {
  const auto& bodies = draft.result.bodies;
  const Domain& domain = draft.result.domain;
  if (table.has("ids")) {
    ++given;
    drive.ids = table.integers("ids");
    check_ids(table, "ids", drive.ids, draft);
  }
  if (table.has("group")) {
    ++given;
    drive.group = table.text("group", std::nullopt);
    const bool found = !drive.group.empty() && std::ranges::find(bodies, drive.group, &BodySpec::group) != bodies.end();
    if (!found && draft.bodies_known)
      table.error("group", fmt::format("{} is the group of no body; use a group given in [[bodies]] or [[grains]]",
                                       in_quotes(drive.group)));
  }
  if (table.has("overlapping")) {
    ++given;
    drive.overlapping = table.choice("overlapping", face_index_names, -1);
    drive.within = table.number("within", 0.0, not_negative);
    if (drive.overlapping < 0) return;
    const int k = drive.overlapping / 2;
    const auto reaches = [&](const BodySpec& body) { return selects(drive, body, -1, domain); };
    if (k >= domain.dimension) {
      table.error("overlapping", "this face belongs to 3D; the case has dimension 2");
    } else if (domain.periodic[k]) {
      table.error("overlapping", fmt::format("direction {} is periodic and has no faces", "xyz"[k]));
    } else if (draft.domain_known && draft.bodies_known && std::ranges::none_of(bodies, reaches)) {
      table.error("overlapping", fmt::format("no body reaches across the face {}", face_names[drive.overlapping]));
    }
  }
}

/// Spin in 2D is one number.
MotionTable read_spin(Table& table, int dimension) {
  MotionTable spin = table.motion("angular_velocity", dimension == 3 ? 3 : 1);
  if (dimension == 3) return spin;
  for (Vec3& w : spin.values) w = Vec3(0, 0, w.x());
  if (!spin.formulas.empty()) std::swap(spin.formulas[0], spin.formulas[2]);
  return spin;
}

/// Where a piston or servo may be.
struct Place {
  int dimension;
  bool face;          // a wall: it slides along the face's normal into the domain
  Vec3 inwards;       // then that direction
  double wave_speed;  // the largest of the deformable materials [m/s]
  double impedance;   // likewise, density x wave speed [kg/(m2 s)]
  double cell;        // the shortest side of one [m]
  Vec3 size;          // of the domain [m]
  double end;         // of the run [s]
};

/// The force, or the pressure and its area.
void read_force(Table& table, const Place& place, Piston& piston) {
  const bool force = table.has("force"), pressure = table.has("pressure");
  if (force == pressure)
    table.missing(pressure ? "pressure" : "force",
                  pressure
                      ? "is given beside force; give one of the two"
                      : "is missing; give force [N] or pressure [Pa]: a number, rows of time and value, or a formula");
  piston.pressure = pressure;
  piston.force = table.motion(pressure ? "pressure" : "force", 1);
  piston.force.repeat = table.boolean("repeat", false) && !piston.force.times.empty();
  if (table.has("area")) piston.area = table.number("area", std::nullopt, positive);
  if (pressure && piston.area == 0 && !place.face)
    table.missing("area", "is missing; a pressure needs the area that it acts on [m2; in 2D m]");
  if (!pressure && piston.area > 0) table.error("area", "is only for a pressure");
  piston.along = place.face ? place.inwards : table.vector("along", place.dimension, std::nullopt);
  if (place.face && table.has("along")) table.error("along", "is only for drives; a wall slides along its normal");
  if (piston.along == Vec3::Zero()) table.error("along", "has no direction; it must not be zero");
  piston.along.normalize();
}

void check_update(Table& table, StressUpdate update) {
  if (update != StressUpdate::both && update != StressUpdate::modified_last)
    table.error("",
                "needs solver.stress_update = \"both\" or \"modified_last\": with others the force of a step is known "
                "too late");
}

/// By default it gives way so easily that a material as hard as the hardest that comes as fast as the force could drive
/// it changes the force by 1/30, and is never faster than where striking that material would press as hard as the
/// force.
void read_servo(Table& table, const Place& place, Piston& piston) {
  constexpr double layers = 2, easy = 30;  // cells of material as heavy as it
  int k = 0;
  piston.along.cwiseAbs().maxCoeff(&k);
  double area = piston.area;
  if (area == 0) {
    area = 1;
    for (int d = 0; d < place.dimension; ++d)
      if (d != k) area *= place.size[d];
  }
  const double impedance = place.impedance * area;
  piston.gain = table.number("gain", easy / impedance, positive);
  piston.damping = 1 / piston.gain;
  const double force = piston.force.largest(place.end) * (piston.pressure ? area : 1);
  piston.largest = table.number("largest", force > 0 ? force / impedance : 0.1 * place.wave_speed, positive);
  piston.mass = layers * place.cell / place.wave_speed * impedance;
}

void read_piston(Table& parent, const Place& place, StressUpdate update, Piston& piston) {
  const bool both = parent.has("piston") && parent.has("servo");
  if (both) return parent.error("servo", "is given beside piston; give one of the two");
  const bool servo = parent.has("servo");
  Table table = parent.table(servo ? "servo" : "piston");
  if (!table.present()) return;
  check_update(table, update);
  read_force(table, place, piston);
  if (servo) {
    read_servo(table, place, piston);
  } else {
    piston.mass = table.number("mass", std::nullopt, positive);
    piston.damping = table.number("damping", 0.0, not_negative);
  }
  table.finish();
}

/// A wheel on the shaft at `about`.
void read_rotor(Table& parent, const Case& c, bool about, Piston& rotor) {
  Table table = parent.table("rotor");
  if (!table.present()) return;
  check_update(table, c.solver.stress_update);
  rotor.mass = table.number("inertia", std::nullopt, positive);
  rotor.force = table.motion("moment", 1);
  rotor.force.repeat = table.boolean("repeat", false) && !rotor.force.times.empty();
  rotor.damping = table.number("damping", 0.0, not_negative);
  rotor.along = Vec3::UnitZ();
  if (c.domain.dimension == 3) rotor.along = table.vector("axis", 3, std::nullopt);
  if (rotor.along == Vec3::Zero()) table.error("axis", "has no direction; it must not be zero");
  rotor.along.normalize();
  if (!about) parent.missing("about", "is missing; a rotor turns about a point");
  table.finish();
}

Place place_in(const Case& c, int face) {
  const Hardness hardness = hardness_of(c.materials);
  Place place{c.domain.dimension,
              face >= 0,
              Vec3::Zero(),
              hardness.wave_speed,
              hardness.impedance,
              smallest_cell(c.domain),
              c.domain.upper - c.domain.lower,
              c.time.end};
  if (face >= 0) place.inwards[face / 2] = face % 2 ? -1 : 1;
  return place;
}

void read_motion(Table& table, const Draft& draft, Drive& drive) {
  const Case& c = draft.result;
  const int dimension = c.domain.dimension;
  drive.velocity = table.motion("velocity", dimension);
  drive.angular_velocity = read_spin(table, dimension);
  const bool repeat = table.boolean("repeat", false);
  drive.velocity.repeat = repeat && !drive.velocity.times.empty();
  drive.angular_velocity.repeat = repeat && !drive.angular_velocity.times.empty();
  if (table.has("about")) drive.about = table.vector("about", dimension, std::nullopt);
  read_piston(table, place_in(c, -1), c.solver.stress_update, drive.piston);
  read_rotor(table, c, drive.about.has_value(), drive.rotor);
}

/// Which faces the case may give: those of periodic directions and of the third dimension in 2D may not.
std::string face_problem(const Domain& domain, int face) {
  if (face / 2 >= domain.dimension) return "belongs to 3D; the case has dimension 2";
  if (domain.periodic[face / 2])
    return fmt::format("direction {} is periodic and has no faces; remove this or the periodicity", "xyz"[face / 2]);
  return {};
}

void read_face(Table table, const Draft& draft, int number, Face& face) {
  const Case& c = draft.result;
  face.type = table.choice("type", face_type_names, FaceType::free);
  const bool wall = face.type == FaceType::wall, moves = face.type == FaceType::fixed || wall;
  if (table.has("velocity") && !moves) table.error("velocity", "is only for faces of type fixed or wall");
  for (const char* key : {"friction", "position", "piston", "servo"})
    if (table.has(key) && !wall) table.error(key, "is only for faces of type wall");
  if (table.has("leaving") && face.type != FaceType::free) table.error("leaving", "is only for faces of type free");
  face.leaving = table.choice("leaving", leaving_names, face.leaving);
  face.velocity = table.motion("velocity", c.domain.dimension);
  face.velocity.repeat = table.boolean("repeat", false) && !face.velocity.times.empty();
  face.friction = table.number("friction", 0.0, friction_range);
  if (table.has("position")) {
    const int k = number / 2;
    const Range inside = draft.domain_known ? Range{c.domain.lower[k], c.domain.upper[k]} : any_finite;
    face.position = table.number("position", std::nullopt, inside);
  }
  read_piston(table, place_in(c, number), c.solver.stress_update, face.piston);
  table.finish();
}

}  // namespace

Hardness hardness_of(const std::vector<Material>& materials) {
  Hardness found{0, 0};
  for (const Material& m : materials) {
    const LawInfo* law = find_law(m.model);
    if (!law || m.model == "rigid") continue;
    const auto known = [&](const Parameter& p) {
      return m.parameters.contains(std::string(p.key)) || m.parameters.contains(list_key(p.key, 0));
    };
    if (!std::ranges::all_of(law->parameters, known)) continue;  // after an error
    const double modulus = longitudinal_modulus(make_law(m.model, m.parameters, m.plane));
    found.wave_speed = std::max(found.wave_speed, std::sqrt(modulus / m.density));
    found.impedance = std::max(found.impedance, std::sqrt(modulus * m.density));
  }
  return found.wave_speed > 0 ? found : Hardness{};
}

void read_drives(Table& root, Draft& draft) {
  for (Table& table : root.tables("drive")) {
    Drive drive;
    int given = 0;
    if (Table bodies = table.table("bodies"); bodies.present()) {
      read_selection(bodies, draft, drive, given);
      bodies.finish();
    }
    read_selection(table, draft, drive, given);
    read_motion(table, draft, drive);
    table.finish();
    if (given != 1)
      table.error("bodies", fmt::format("{} selections are given; give one of {{ overlapping = \"FACE\" }}, {{ ids = "
                                        "[...] }}, {{ group = \"...\" }}",
                                        given));
    draft.result.drives.push_back(std::move(drive));
  }
}

void read_boundary(Table boundary, Draft& draft) {
  const Domain& domain = draft.result.domain;
  auto& faces = draft.result.faces;
  for (int face = 0; face < 6; ++face) {
    if (face / 2 < domain.dimension && domain.periodic[face / 2]) faces[face].type = FaceType::periodic;
    if (face / 2 >= domain.dimension && !boundary.present()) break;
    const char* name = face_names[face];
    if (!boundary.has(name)) continue;
    const std::string problem = face_problem(domain, face);
    if (problem.empty()) {
      read_face(boundary.table(name), draft, face, faces[face]);
    } else {
      boundary.error(name, problem);
    }
  }
  boundary.finish();
}

}  // namespace cairn::reading

namespace cairn {

bool moves(const Face& face, int number) {
  if (face.type != FaceType::wall) return false;
  const auto& v = face.velocity;
  const int k = number / 2;
  const bool still = v.formulas.empty() ? std::ranges::all_of(v.values, [&](const Vec3& u) { return u[k] == 0; })
                                        : v.formulas[k] == Formula("0");
  return face.position || face.piston.mass > 0 || !still;
}

}  // namespace cairn
