// What nodes do not see of the points' velocities and spins, and its filter.
//
// With S: points -> nodes (momentum, that of spins included, over mass) and S+: nodes -> points (v = sum N u,
// w = sum N arm x u / sum N arm^2), S+ S is self-adjoint in the metric of kinetic energy, with eigenvalues from 0 to 1
// and rigid motions as fixed points. What it does not return, the null space of Gritton & Berzins (Comput. Part. Mech.
// 4, 2017), takes part in no strain: a bath into which every quadrature error feeds, with no way out. So
//   q -= share (1 - S+ S)^order q
// leaves momentum and angular momentum as they are and only takes energy. With share = 1 at every step it is the
// velocity update of XPIC(order) (Hammerquist & Nairn, Comput. Methods Appl. Mech. Engrg. 318, 2017).

#include <map>

#include "cairn/solver/simulation.hpp"

namespace cairn {
namespace {

/// How often, and the rate at which noise goes for each cell that a wave of the body's material crosses.
struct Plan {
  int every;    // steps; 0: never
  double rate;  // infinite: all of it
};

Plan plan_of(NoiseFilter filter) {
  switch (filter) {
    case NoiseFilter::weak:
      return {20, 0.005};
    case NoiseFilter::strong:
      return {20, 0.05};
    case NoiseFilter::xpic:
      return {1, std::numeric_limits<double>::infinity()};
    case NoiseFilter::off:
      break;
  }
  return {0, 0};
}

/// Columns that hold a point's motion.
template <int Dim>
std::vector<int> motion_columns(bool spin) {
  using C = PointColumns<Dim>;
  std::vector<int> columns;
  for (int d = 0; d < Dim; ++d) columns.push_back(C::velocity + d);
  for (int s = 0; s < (spin ? spin_size<Dim> : 0); ++s) columns.push_back(C::spin + s);
  return columns;
}

/// A piece's motion as it was, and what it takes to book its energy.
template <int Dim>
struct PieceMotion {
  explicit PieceMotion(const Piece<Dim>& piece, const std::vector<int>& columns, double density,
                       std::vector<std::array<double, spin_size<Dim>>> inertia_)
      : inertia(std::move(inertia_)) {
    for (int c : columns)
      values.insert(values.end(), piece.points.column(c), piece.points.column(c) + piece.points.size());
    add_energy(piece, density, 1);
  }

  std::vector<double> values;                               // by column
  std::vector<std::array<double, spin_size<Dim>>> inertia;  // of spins, over mass [m2]
  double moving = 0, spinning = 0;                          // kinetic energy of velocities and of spins [J]

  /// Where the points hold what no node sees of their motion: the motion less a share of that. Leaves the energies
  /// taken.
  void restore_but(double share, Piece<Dim>& piece, const std::vector<int>& columns, double density) {
    const double* before = values.data();
    for (int c : columns)
      for (double *v = piece.points.column(c), *end = v + piece.points.size(); v != end; ++v)
        *v = *before++ - share * *v;
    add_energy(piece, density, -1);
  }

 private:
  void add_energy(const Piece<Dim>& piece, double density, double sign) {
    using C = PointColumns<Dim>;
    for (int p = 0; p < piece.points.size(); ++p) {
      const double half_mass = sign * 0.5 * density * piece.points.column(C::volume)[p];
      for (int d = 0; d < Dim; ++d) moving += half_mass * std::pow(piece.points.column(C::velocity + d)[p], 2);
      for (int s = 0; s < spin_size<Dim>; ++s)
        spinning += half_mass * inertia[p][s] * std::pow(piece.points.column(C::spin + s)[p], 2);
    }
  }
};

}  // namespace

template <int Dim>
void Simulation<Dim>::filter_noise() {
  const Plan plan = plan_of(solver_.noise_filter);
  if (plan.every == 0 || steps_ == 0 || steps_ % plan.every != 0) return;
  const auto time = timers_.measure(Stage::filter);
  const std::vector<int> columns = motion_columns<Dim>(transfer_.spin);
  std::vector<std::map<int, PieceMotion<Dim>>> motions(patches_.size());  // by body

  const auto keep = [&](std::size_t p, Patch<Dim>& patch) {
    project_points(p, patch);
    for (auto& piece : patch.pieces) {
      if (is_rigid(piece)) continue;
      motions[p].emplace(piece.body, PieceMotion<Dim>(piece, columns, material_of(piece).density,
                                                      spin_inertia(piece, lattice_, transfer_)));
    }
  };
  const auto subtract_seen_part = [&](std::size_t p, Patch<Dim>& patch, bool first) {
    exchange_->add(patch, p);
    first ? mirror_sums(patch, lattice_, contact_.faces)
          : mirror_vectors(patch, lattice_, contact_.faces, &NodeBox<Dim>::velocity);
    for (auto& piece : patch.pieces) {
      first ? velocity_from_sums(piece) : velocity_from_momentum(piece);
      piece.projected = false;
      if (!is_rigid(piece)) subtract_seen(piece, lattice_, transfer_);
    }
  };
  const auto subtract_noise = [&](std::size_t p, Patch<Dim>& patch) {
    for (auto& piece : patch.pieces) {
      if (!projects_again()) velocities_.take_back(piece.nodes.velocity), motions_.take_back(piece.nodes.motion);
      if (is_rigid(piece) || piece.points.size() == 0) continue;
      const SolverMaterial& material = material_of(piece);
      const double speed = std::sqrt(material.longitudinal_modulus / material.density);
      const double share = 1 - std::exp(-plan.rate * plan.every * dt_ * speed / lattice_.smallest_spacing());
      PieceMotion<Dim>& motion = motions[p].at(piece.body);
      motion.restore_but(share, piece, columns, material.density);
      patch.ledger.filtered += motion.moving + motion.spinning;
      patch.ledger.blended_and_spun -= motion.spinning;  // of spins, the book takes what they have
    }
  };

  exchange_->begin_sums(transfer_.extras);
  exchange_after(keep);
  for (int round = 0; round < solver_.noise_order; ++round) {
    const bool last = round + 1 == solver_.noise_order;
    if (!last) exchange_->begin(&NodeBox<Dim>::velocity);
    const auto compute = [&](std::size_t p, Patch<Dim>& patch) {
      subtract_seen_part(p, patch, round == 0);
      if (last) return subtract_noise(p, patch);
      for (auto& piece : patch.pieces)
        project_momentum(piece, lattice_, transfer_of(piece), material_of(piece).density);
    };
    last ? for_patches([&](std::size_t p, Patch<Dim>&) { timed(p, compute); }) : exchange_after(compute);
  }
}

template void Simulation<2>::filter_noise();
template void Simulation<3>::filter_noise();

}  // namespace cairn
