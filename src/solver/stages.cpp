// What a stage changes, and what is measured to tell when it ends.

#include "cairn/body/deformation.hpp"
#include "cairn/parallel/patch_sums.hpp"
#include "cairn/solver/body_states.hpp"
#include "cairn/solver/simulation.hpp"
#include "setup.hpp"

namespace cairn {

template <int Dim>
void Simulation<Dim>::keep_what_is_asked(const Case& c) {
  moved_bodies_.clear();
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    if (bodies_[b].tool >= 0 && tools_[bodies_[b].tool].moves()) moved_bodies_.push_back(static_cast<int>(b));
  pushed_tools_ = std::ranges::any_of(tools_, &Tool::is_pushed);
  const auto asks = [](const Until& u) { return std::isfinite(u.force) || std::isfinite(u.pressure); };
  contact_.keep_tools = c.output.forces.active() || pushed_tools_ || asks(c.time.until);
  contact_.keep_contacts = c.output.grains.active() || c.output.contacts.active();
  for (const RunStage& stage : c.stages) {
    const Output& output = stage.changed->output;
    contact_.keep_tools = contact_.keep_tools || output.forces.active() || asks(stage.until);
    contact_.keep_contacts = contact_.keep_contacts || output.grains.active() || output.contacts.active();
  }
}

template <int Dim>
void Simulation<Dim>::change(const Case& c) {
  finish_speed_reduction();
  limits_.cfl = c.time.cfl, limits_.dt = c.time.dt, damping_ = c.damping;
  contact_.pairs = ContactSettings<Dim>::make(c.contact, contact_.materials, contact_.faces).pairs;
  const FaceConditions<Dim> faces = make_faces<Dim>(c);
  for (int f = 0; f < 2 * Dim; ++f) contact_.faces[f].friction = faces[f].friction;
  gravity_ = c.domain.gravity;
  for (int d = 0; d < Dim; ++d)
    if (deformation_.axes[d].by != c.domain.deformation.axes[d].by) needed_rates_[d] = 0;
  deformation_ = c.domain.deformation;
  pull_by(gravity_.at(time_));
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    Tool& tool = tools_[t];
    const bool face = t < tools_of_faces;
    if (!face && t - tools_of_faces >= c.drives.size()) continue;  // a rigid body of its own
    const Drive* drive = face ? nullptr : &c.drives[t - tools_of_faces];
    tool.velocity = face ? c.faces[t].velocity : drive->velocity;
    tool.spin = face ? MotionTable() : drive->angular_velocity;
    const Piston& piston = face ? c.faces[t].piston : drive->piston;
    // A weight goes on as fast as the tool was.
    const Vec3 given = tool.velocity.at(time_);
    if (piston.mass > 0 && (tool.piston.mass == 0 || tool.piston.along != piston.along))
      tool.speed = (tool.now - given).dot(piston.along);
    if (piston.mass == 0) tool.speed = 0;
    tool.piston = piston;
    tool.now = tool.next = given + tool.speed * piston.along;
    const Piston rotor = face ? Piston() : drive->rotor;
    const Vec3 given_spin = tool.spin.at(time_);
    if (rotor.mass > 0 && tool.rotor.mass == 0) tool.turning = (tool.spin_now - given_spin).dot(rotor.along);
    if (rotor.mass == 0) tool.turning = 0;
    tool.rotor = rotor;
    tool.spin_now = tool.spin_next = given_spin + tool.turning * rotor.along;
    maxima_[1] = std::max(maxima_[1], tool.now.norm());
  }
  keep_what_is_asked(c);
  for (Body& body : bodies_)
    if (body.tool >= 0)
      body.velocity = tools_[body.tool].now, body.angular_velocity = tools_[body.tool].spin_now, body.change.setZero();
  const SpeedLimits speeds = speeds_;
  const double dt = std::exchange(dt_, 0.0);
  for (auto& patch : patches_)
    for (auto& piece : patch.pieces)
      if (is_rigid(piece)) move_rigid(piece), piece.projected = false;
  speeds_ = speeds, dt_ = dt;
}

template <int Dim>
double Simulation<Dim>::packing_fraction() const {
  using C = PointColumns<Dim>;
  PatchSums<1> sums;
  for (const auto& patch : patches_) {
    if (patch.point_count() == 0) continue;
    double volume = 0;
    for (const auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p)
        volume += piece.points.column(C::volume)[p] * volume_ratio(piece.points, p);
    sums.add(patch.id, {volume});
  }
  return sums.on_all(comm_)[0] / room();
}

template <int Dim>
ForceBalance Simulation<Dim>::weigh_bodies() const {
  std::vector<PieceVector> nets;
  PatchSums<1> pressing;
  for (const auto& patch : patches_) {
    for (const auto& piece : patch.pieces)
      if (!is_rigid(piece) && piece.net_force != Vec3::Zero()) nets.push_back({piece.body, patch.id, piece.net_force});
    if (patch.pressing > 0) pressing.add(patch.id, {patch.pressing});
  }
  ForceBalance balance;
  balance.pressing = pressing.on_all(comm_)[0];
  const std::vector<double> sizes = sizes_of_bodies(*this, nets);
  for (const double size : sizes) balance.largest_net = std::max(balance.largest_net, size);
  MPI_Allreduce(MPI_IN_PLACE, &balance.largest_net, 1, MPI_DOUBLE, MPI_MAX, comm_);
  // In whole parts of the largest the sum is the same in any order, and no rank needs all bodies.
  constexpr double parts = 0x1p40;
  std::int64_t sums[2] = {0, std::ssize(sizes)};
  for (const double size : sizes) sums[0] += std::llround(size / balance.largest_net * parts);
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_INT64_T, MPI_SUM, comm_);
  balance.net = static_cast<double>(sums[0]) / parts * balance.largest_net, balance.bodies = sums[1];
  return balance;
}

#define CAIRN_INSTANTIATE(Dim)                                    \
  template void Simulation<Dim>::keep_what_is_asked(const Case&); \
  template void Simulation<Dim>::change(const Case&);             \
  template double Simulation<Dim>::packing_fraction() const;      \
  template ForceBalance Simulation<Dim>::weigh_bodies() const;
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
