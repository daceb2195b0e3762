// Ways to rest, each booked to the last bit of kinetic energy, and none of which gives any.
//
// Local damping (Cundall, Ball & Shinozuka 1987): a point with the acceleration a and the velocity v between the start
// and the end of the step gets -min(alpha |a|, |v| / dt) sign(v) in each direction, so that it slows what moves against
// its own inertia and leaves a steady motion alone. Viscous: v and spins fade by exp(-rate dt). Relaxation: velocities
// and spins are set to zero at the step after a peak of the kinetic energy (Otter, Cassell & Hobbs 1966; kinetic
// damping).

#include "cairn/parallel/patch_sums.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {
namespace {

/// What a piece's points have of motion: kinetic energy of velocities and of spins [J], and half a step's work of
/// gravity [J], by which kinetic and potential energy are apart as velocities and positions are.
struct NetMotion {
  double moving = 0, spinning = 0, ahead = 0;
  NetMotion& operator+=(const NetMotion& other) {
    moving += other.moving, spinning += other.spinning, ahead += other.ahead;
    return *this;
  }
  double kinetic() const { return moving + spinning; }
  /// What has gone of it, into the book. Of spins the book takes what they have.
  void book(PatchLedger& ledger, const NetMotion& after) const {
    ledger.damped += kinetic() - after.kinetic();
    ledger.blended_and_spun += ahead - after.ahead - (spinning - after.spinning);
  }
};

template <int Dim>
NetMotion motion_of(const Piece<Dim>& piece, double density,
                    const std::vector<std::array<double, spin_size<Dim>>>& inertia, const Vec<Dim>& gravity,
                    double dt) {
  using C = PointColumns<Dim>;
  NetMotion motion;
  for (int p = 0; p < piece.points.size(); ++p) {
    const double half_mass = 0.5 * density * piece.points.column(C::volume)[p];
    for (int d = 0; d < Dim; ++d) {
      const double v = piece.points.column(C::velocity + d)[p];
      motion.moving += half_mass * v * v, motion.ahead += half_mass * dt * gravity[d] * v;
    }
    for (int s = 0; s < spin_size<Dim>; ++s)
      motion.spinning += half_mass * inertia[p][s] * std::pow(piece.points.column(C::spin + s)[p], 2);
  }
  return motion;
}

template <int Dim>
void slow(Piece<Dim>& piece, int p, double factor, bool spin) {
  using C = PointColumns<Dim>;
  for (int d = 0; d < Dim; ++d) piece.points.column(C::velocity + d)[p] *= factor;
  for (int s = 0; s < (spin ? spin_size<Dim> : 0); ++s) piece.points.column(C::spin + s)[p] *= factor;
}

}  // namespace

/// The net force on each piece, and how hard contacts press.
template <int Dim>
void Simulation<Dim>::weigh_forces(Patch<Dim>& patch) {
  if (!keep_balance_) return;
  for (auto& piece : patch.pieces) {
    piece.net_force.setZero();
    if (is_rigid(piece)) continue;
    const auto add = [&](const Index<Dim>& place, int row) {
      const double share = node_share<Dim>(patch.id, place, lattice_, contact_.faces);
      if (share == 0) return;
      const double mass = piece.nodes.sums[static_cast<std::size_t>(row) * NodeSums<Dim>::width];
      for (int d = 0; d < Dim; ++d)
        piece.net_force[d] +=
            share * mass * piece.nodes.motion[static_cast<std::size_t>(row) * NodeMotion<Dim>::width + d];
    };
    int row = 0;
    for_each(piece.nodes.box, [&](const Index<Dim>& place) { add(place, row++); });
    for (const auto& further : piece.nodes.further.rows) add(further.place, row++);
  }
}

/// Damps a piece's points, which have been accelerated in this step, and moved not yet.
template <int Dim>
void Simulation<Dim>::damp(Patch<Dim>& patch, Piece<Dim>& piece) {
  using C = PointColumns<Dim>;
  if (!(damping_.local > 0 || damping_.viscous > 0) || is_rigid(piece) || piece.points.size() == 0) return;
  const double density = material_of(piece).density, fading = std::exp(-damping_.viscous * dt_);
  const auto inertia = spin_inertia(piece, lattice_, transfer_);
  const NetMotion before = motion_of(piece, density, inertia, transfer_.gravity, dt_);
  if (damping_.local > 0) {
    const auto kinematics = point_kinematics(piece, lattice_, transfer_);
    for (int p = 0; p < piece.points.size(); ++p)
      for (int d = 0; d < Dim; ++d) {
        double& v = piece.points.column(C::velocity + d)[p];
        const double a = kinematics[p][d], middle = v - 0.5 * dt_ * a;
        const double most = std::min(std::abs(middle), std::abs(v));  // beyond that it would turn the motion round
        if (middle * v > 0) v -= std::copysign(std::min(dt_ * damping_.local * std::abs(a), most), v);
      }
  }
  if (fading < 1)
    for (int p = 0; p < piece.points.size(); ++p) slow(piece, p, fading, transfer_.spin);
  before.book(patch.ledger, motion_of(piece, density, inertia, transfer_.gravity, dt_));
}

/// Takes all motion away where the kinetic energy of the last step was a peak.
template <int Dim>
void Simulation<Dim>::relax() {
  if (!damping_.relax) return;
  PatchSums<1> sums;
  std::vector<NetMotion> motions;
  for (const auto& patch : patches_) {
    if (patch.point_count() == 0) continue;
    NetMotion sum;
    for (const auto& piece : patch.pieces) {
      if (is_rigid(piece)) continue;
      const auto inertia = spin_inertia(piece, lattice_, transfer_);
      sum += motion_of(piece, material_of(piece).density, inertia, transfer_.gravity, dt_);
    }
    motions.push_back(sum);
    sums.add(patch.id, {sum.kinetic()});
  }
  const double now = sums.on_all(comm_)[0];
  const bool peak = now < kinetic_[0] && kinetic_[0] >= kinetic_[1];
  kinetic_ = {peak ? 0.0 : now, peak ? 0.0 : kinetic_[0]};
  if (!peak) return;
  auto motion = motions.begin();
  for (auto& patch : patches_) {
    if (patch.point_count() == 0) continue;
    for (auto& piece : patch.pieces) {
      if (is_rigid(piece)) continue;
      for (int p = 0; p < piece.points.size(); ++p) slow(piece, p, 0.0, true);
      piece.projected = false;
    }
    (motion++)->book(patch.ledger, {});
  }
}

#define CAIRN_INSTANTIATE(Dim)                                   \
  template void Simulation<Dim>::weigh_forces(Patch<Dim>&);      \
  template void Simulation<Dim>::damp(Patch<Dim>&, Piece<Dim>&); \
  template void Simulation<Dim>::relax();
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
