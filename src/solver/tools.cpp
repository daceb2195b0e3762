// Tools: what they are, how they move, and what bodies do to them.

#include <fmt/format.h>

#include <map>

#include "cairn/core/error.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {
namespace {

constexpr const char* names_of_faces[] = {"left", "right", "bottom", "top", "back", "front"};

/// The record of one patch's sum on its way: patch, tool, total, last.
constexpr int record_size = 2 + ToolSum::size + 6;

/// Adds records in the order of their patches.
std::vector<ToolSum> sum_in_order(const std::vector<double>& records, std::size_t tools) {
  std::map<std::pair<double, double>, const double*> ordered;  // patch, tool
  for (std::size_t i = 0; i < records.size(); i += record_size) ordered[{records[i], records[i + 1]}] = &records[i + 2];
  std::vector<ToolSum> sums(tools);
  for (const auto& [key, values] : ordered) {
    ToolSum sum;
    std::copy_n(values, ToolSum::size, sum.total.begin());
    std::copy_n(values + ToolSum::size, 6, sum.last.begin());
    sums[static_cast<std::size_t>(key.second)].add(sum);
  }
  return sums;
}

/// F of a rigid body's points, from which CPDI takes their domains.
template <int Dim>
void turn_deformation(Points<Dim>& points, const Mat3& turn) {
  using C = PointColumns<Dim>;
  for (int p = 0; p < points.size(); ++p)
    for (int j = 0; j < Dim; ++j) {
      Vec3 column = Vec3::Zero();
      for (int i = 0; i < Dim; ++i) column[i] = points.column(C::deformation + tensor_index<Dim>(i, j))[p];
      column = turn * column;
      for (int i = 0; i < Dim; ++i) points.column(C::deformation + tensor_index<Dim>(i, j))[p] = column[i];
    }
}

}  // namespace

std::vector<Tool> make_tools(const Case& c, std::vector<Body>& bodies) {
  std::vector<Tool> tools(tools_of_faces);
  for (int face = 0; face < tools_of_faces; ++face) {
    tools[face].name = names_of_faces[face];
    tools[face].centre = 0.5 * (c.domain.lower + c.domain.upper);
    tools[face].centre[face / 2] = face % 2 ? c.domain.upper[face / 2] : c.domain.lower[face / 2];
    if (c.faces[face].position) tools[face].centre[face / 2] = *c.faces[face].position;
    tools[face].velocity = c.faces[face].velocity, tools[face].piston = c.faces[face].piston;
  }
  for (std::size_t d = 0; d < c.drives.size(); ++d) {
    const Drive& drive = c.drives[d];
    Tool tool{drive.group.empty() ? fmt::format("drive{}", d) : drive.group,
              Vec3::Zero(),
              drive.velocity,
              drive.angular_velocity,
              drive.piston,
              drive.rotor};
    int count = 0;
    for (std::size_t b = 0; b < bodies.size(); ++b)
      if (selects(drive, c.bodies[b], static_cast<int>(b), c.domain)) {
        bodies[b].tool = static_cast<std::int32_t>(tools.size());
        if (drive.about) bodies[b].centre = *drive.about;
        tool.centre += bodies[b].centre, ++count;
      }
    if (count > 0) tool.centre /= count;
    if (drive.about) tool.centre = *drive.about;
    tools.push_back(std::move(tool));
  }
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (!bodies[b].rigid || bodies[b].tool >= 0) continue;
    bodies[b].tool = static_cast<std::int32_t>(tools.size());
    tools.push_back(
        {fmt::format("body{}", b), bodies[b].centre, bodies[b].velocity, bodies[b].angular_velocity, {}, {}});
  }
  for (Tool& tool : tools) tool.now = tool.next = tool.velocity.at(0), tool.spin_now = tool.spin_next = tool.spin.at(0);
  return tools;
}

/// The velocity at the end of the step, as far as it is given.
template <int Dim>
void Simulation<Dim>::begin_tools() {
  for (Tool& tool : tools_) {
    if (!tool.moves()) continue;
    tool.next = tool.velocity.at(time_ + dt_) + tool.speed * tool.piston.along;
    tool.spin_next = tool.spin.at(time_ + dt_) + tool.turning * tool.rotor.along;
  }
  for (const int b : moved_bodies_) bodies_[b].change = tools_[bodies_[b].tool].next - tools_[bodies_[b].tool].now;
  for (int face = 0; face < 2 * Dim; ++face)
    contact_.faces[face].velocity = (0.5 * (tools_[face].now + tools_[face].next)).template head<Dim>();
}

template <int Dim>
template <class Wanted>
std::vector<double> Simulation<Dim>::tool_records(Wanted&& wanted) const {
  std::vector<double> records;
  for (const auto& patch : patches_)
    for (const auto& [tool, sum] : patch.tools) {
      if (!wanted(tool)) continue;
      records.push_back(patch.id), records.push_back(tool);
      records.insert(records.end(), sum.total.begin(), sum.total.end());
      records.insert(records.end(), sum.last.begin(), sum.last.end());
    }
  return records;
}

/// What bodies press in this step moves pistons and rotors. Collective where there are some.
template <int Dim>
void Simulation<Dim>::push_tools() {
  if (!pushed_tools_) return;
  const auto pushed = [&](int tool) { return tools_[tool].is_pushed(); };
  const std::vector<ToolSum> sums = sum_in_order(gather_on_all(tool_records(pushed), comm_), tools_.size());
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    Tool& tool = tools_[t];
    const Vec3 pressed(sums[t].last[0], sums[t].last[1], sums[t].last[2]),
        moment = Vec3(sums[t].last[3], sums[t].last[4], sums[t].last[5]) - tool.place().cross(pressed);
    if (const Piston& piston = tool.piston; piston.mass > 0) {
      double force = piston.force.at(time_).x();
      if (piston.pressure) force *= piston.area > 0 ? piston.area : face_area(static_cast<int>(t));
      const double speed = tool.speed + gained(piston, tool.speed, force, pressed.dot(piston.along), dt_);
      const double before = std::exchange(tool.speed, std::clamp(speed, -piston.largest, piston.largest));
      tool.next += (tool.speed - before) * piston.along;
    }
    if (const Piston& rotor = tool.rotor; rotor.mass > 0) {
      const double change = gained(rotor, tool.turning, rotor.force.at(time_).x(), moment.dot(rotor.along), dt_);
      tool.turning += change;
      tool.spin_next += change * rotor.along;
    }
  }
}

/// Where the walls will stand at the end of the step.
template <int Dim>
void Simulation<Dim>::aim_walls() {
  for (int face = 0; face < 2 * Dim; ++face) {
    if (!contact_.faces[face].moves) continue;
    const int d = face / 2;
    const double to = transfer_.wall_from[d][face % 2] + dt_ * tools_[face].of_step()[d];
    if (to < lattice_.lower()[d] - 1e-9 * lattice_.length(d) || to > lattice_.upper()[d] + 1e-9 * lattice_.length(d))
      throw RunError(
          fmt::format("step {}: the wall {} leaves the domain; let the domain be larger and the wall begin "
                      "inside, at boundary.{}.position",
                      steps_ + 1, tools_[face].name, tools_[face].name));
    transfer_.wall_to[d][face % 2] = to;
    if (transfer_.wall_to[d][0] >= transfer_.wall_to[d][1])
      throw RunError(fmt::format("step {}: the walls {} and {} meet", steps_ + 1, names_of_faces[2 * d],
                                 names_of_faces[2 * d + 1]));
  }
}

/// Walls stand where their tools are.
template <int Dim>
void Simulation<Dim>::place_walls() {
  for (int face = 0; face < 2 * Dim; ++face) {
    const int d = face / 2, side = face % 2;
    double& plane = contact_.faces[face].plane;
    plane = contact_.faces[face].moves ? tools_[face].place()[d] : side ? lattice_.upper()[d] : lattice_.lower()[d];
    transfer_.wall_from[d][side] = transfer_.wall_to[d][side] = plane;
  }
  transfer_of_turning_.wall_from = transfer_.wall_from, transfer_of_turning_.wall_to = transfer_.wall_to;
}

template <int Dim>
double Simulation<Dim>::face_distance(int face) const {
  const int d = face / 2;
  return transfer_.wall_from[d][1] - transfer_.wall_from[d][0];
}

template <int Dim>
double Simulation<Dim>::face_area(int face) const {
  double area = 1;
  for (int d = 0; d < Dim; ++d)
    if (d != face / 2) area *= face_distance(2 * d);
  return area;
}

template <int Dim>
double Simulation<Dim>::room() const {
  double volume = 1;
  for (int d = 0; d < Dim; ++d) volume *= face_distance(2 * d);
  return volume;
}

template <int Dim>
void Simulation<Dim>::end_tools() {
  for (Tool& tool : tools_) {
    tool.travel += dt_ * tool.of_step();
    tool.now = tool.next, tool.spin_now = tool.spin_next;
  }
  set_velocities_of_tools();
  place_walls();
}

/// Sets the gravity of the steps from now on. What it changes of the points' potential energy is work from outside.
template <int Dim>
void Simulation<Dim>::pull_by(const Vec3& gravity) {
  const Vec<Dim> change = gravity.head<Dim>() - transfer_.gravity;
  if (change.isZero(0)) return;
  transfer_.gravity = transfer_of_turning_.gravity = gravity.head<Dim>();
  for (auto& patch : patches_)
    for (auto& piece : patch.pieces) {
      piece.projected = false;
      if (is_rigid(piece)) continue;
      const Points<Dim>& points = piece.points;
      double lifted = 0;
      for (int p = 0; p < points.size(); ++p)
        for (int d = 0; d < Dim; ++d)
          lifted += change[d] * points.column(PointColumns<Dim>::volume)[p] *
                    (points.column(d)[p] + points.images()[p][d] * lattice_.length(d));
      patch.ledger.boundary_work -= material_of(piece).density * lifted;
    }
}

template <int Dim>
void Simulation<Dim>::set_velocities_of_tools() {
  for (const int b : moved_bodies_) {
    const Tool& tool = tools_[bodies_[b].tool];
    bodies_[b].velocity = tool.now, bodies_[b].angular_velocity = tool.spin_now;
  }
}

/// The stress of a driven body turns with it: its nodes have the velocity of the rigid motion, whose gradient is its
/// spin.
template <int Dim>
void Simulation<Dim>::turn_stress(Piece<Dim>& piece) {
  const auto& material = material_of(piece);
  if (material.rigid || !turns_rigidly(piece)) return;
  velocities_.lend(piece.nodes.velocity);
  velocity_from_sums(piece);
  SpeedLimits unlimited;  // no wave runs through it
  update_stress(piece, lattice_, transfer_, material.law, material.density, dt_, unlimited);
  if (!std::isfinite(unlimited.wave)) speeds_.wave = unlimited.wave;
}

/// Points of a rigid body turn about its centre, which travels with its tool.
template <int Dim>
void Simulation<Dim>::move_rigid(Piece<Dim>& piece) {
  using C = PointColumns<Dim>;
  const Body& body = bodies_[piece.body];
  const Tool& tool = tools_[body.tool];
  Points<Dim>& points = piece.points;
  const Vec3 spin = tool.spin_of_step(), way = dt_ * tool.of_step(), centre = body.centre + tool.travel;
  const double speed = spin.norm();
  const Vec3 axis = speed > 0 ? Vec3(spin / speed) : Vec3::UnitZ();
  const Mat3 turn = Eigen::AngleAxisd(speed * dt_, axis).toRotationMatrix();
  for (int p = 0; p < points.size(); ++p) {
    Vec3 arm = Vec3::Zero();
    for (int d = 0; d < Dim; ++d) arm[d] = points.column(d)[p] + points.images()[p][d] * lattice_.length(d) - centre[d];
    const Vec3 turned = speed > 0 ? Vec3(turn * arm) : arm;
    const Vec3 velocity = tool.next + tool.spin_next.cross(turned);
    for (int d = 0; d < Dim; ++d) {
      points.column(d)[p] += way[d] + turned[d] - arm[d];
      points.column(C::velocity + d)[p] = velocity[d];
    }
    for (int s = 0; s < spin_size<Dim>; ++s) points.column(C::spin + s)[p] = tool.spin_next[Dim == 2 ? 2 : s];
    speeds_.point = std::max(speeds_.point, velocity.norm());
  }
  if (transfer_.shape == ShapeFunction::cpdi && material_of(piece).rigid && speed > 0) turn_deformation(points, turn);
}

template <int Dim>
std::vector<double> Simulation<Dim>::impulse_on(int tool) const {
  const auto sums = sum_in_order(gather_on_all(tool_records([&](int t) { return t == tool; }), comm_), tools_.size());
  return {sums[tool].total[0], sums[tool].total[1], sums[tool].total[2]};
}

template <int Dim>
std::vector<ToolSum> Simulation<Dim>::tool_sums() const {
  return sum_in_order(gather_on_first(tool_records([](int) { return true; }), comm_), tools_.size());
}

template <int Dim>
std::vector<double> Simulation<Dim>::tool_states() const {
  std::vector<double> states;
  for (const Tool& tool : tools_)
    for (const double number : tool.state()) states.push_back(number);
  return states;
}

template <int Dim>
void Simulation<Dim>::restore_tools(const std::vector<double>& states) {
  if (states.size() != tools_.size() * tool_state_size)
    throw InputError(fmt::format("the checkpoint is of a case with {} tools (faces, drives and rigid bodies), not {}",
                                 states.size() / tool_state_size, tools_.size()));
  for (std::size_t t = 0; t < tools_.size(); ++t) tools_[t].restore(&states[t * tool_state_size]);
  set_velocities_of_tools();
  place_walls();
}

#define CAIRN_INSTANTIATE(Dim)                                              \
  template std::vector<double> Simulation<Dim>::tool_states() const;        \
  template void Simulation<Dim>::restore_tools(const std::vector<double>&); \
  template void Simulation<Dim>::turn_stress(Piece<Dim>&);                  \
  template void Simulation<Dim>::move_rigid(Piece<Dim>&);                   \
  template void Simulation<Dim>::begin_tools();                             \
  template void Simulation<Dim>::push_tools();                              \
  template void Simulation<Dim>::end_tools();                               \
  template void Simulation<Dim>::set_velocities_of_tools();                 \
  template void Simulation<Dim>::aim_walls();                               \
  template void Simulation<Dim>::place_walls();                             \
  template void Simulation<Dim>::pull_by(const Vec3&);                      \
  template double Simulation<Dim>::face_distance(int) const;                \
  template double Simulation<Dim>::face_area(int) const;                    \
  template double Simulation<Dim>::room() const;                            \
  template std::vector<double> Simulation<Dim>::impulse_on(int) const;      \
  template std::vector<ToolSum> Simulation<Dim>::tool_sums() const;
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
