#include <map>

#include "cairn/solver/simulation.hpp"

namespace cairn {
namespace {

constexpr int sum_count = 16;
using Sums = std::array<double, sum_count>;  // kinetic, strain, potential, plastic, dissipation, work, momentum, mass,
                                             // nodes, viscous, numerical, filtered, gain, stopped

/// One point's deformation gradient.
template <int Dim>
Tensor<Dim, double> deformation_of(const Points<Dim>& points, int p) {
  Tensor<Dim, double> F;
  for (int i = 0; i < tensor_size<Dim>; ++i) F.c[i] = points.column(PointColumns<Dim>::deformation + i)[p];
  return F;
}

template <int Dim>
void add_piece(const Simulation<Dim>& simulation, const Piece<Dim>& piece, const Vec<Dim>& gravity, Sums& sums) {
  using C = PointColumns<Dim>;
  const SolverMaterial& material = simulation.material_of(piece);
  const Points<Dim>& points = piece.points;
  const auto inertia = spin_inertia(piece, simulation.lattice(), simulation.transfer());
  std::visit(
      [&](const auto& law) {
        std::array<double, state_capacity> state{};
        for (int p = 0; p < points.size(); ++p) {
          const double volume = points.column(C::volume)[p], mass = material.density * volume;
          sums[9] += mass;
          if (simulation.is_rigid(piece)) continue;
          for (int s = 0; s < points.columns() - C::state; ++s) state[s] = points.column(C::state + s)[p];
          double squared = 0, height = 0;
          for (int d = 0; d < Dim; ++d) {
            const double v = points.column(C::velocity + d)[p];
            squared += v * v;
            height += gravity[d] * (points.column(d)[p] + points.images()[p][d] * simulation.lattice().length(d));
            sums[6 + d] += mass * v;
          }
          double spin = 0;
          for (int s = 0; s < spin_size<Dim>; ++s) spin += inertia[p][s] * std::pow(points.column(C::spin + s)[p], 2);
          sums[0] += 0.5 * mass * (squared + spin);
          sums[12] -= 0.5 * mass * spin;
          sums[1] += volume * law.strain_energy(deformation_of(points, p), state.data());
          sums[2] -= mass * height;
          sums[3] += volume * law.plastic_work(state.data());
          if constexpr (requires { law.viscous_dissipation(state.data()); })
            sums[11] += volume * law.viscous_dissipation(state.data());
        }
      },
      material.law);
}

}  // namespace

template <int Dim>
Totals Simulation<Dim>::totals() const {
  // Partial sums of every patch go to rank 0, which adds them in patch order.
  std::vector<double> mine;
  for (const auto& patch : patches_) {
    Sums sums{};
    for (const auto& piece : patch.pieces) add_piece(*this, piece, transfer_.gravity, sums);
    sums[4] = patch.ledger.contact_dissipation, sums[5] = patch.ledger.boundary_work;
    sums[10] = patch.ledger.contact_nodes, sums[12] += patch.ledger.blended_and_spun;
    sums[13] = patch.ledger.filtered, sums[14] = patch.ledger.contact_gain, sums[15] = patch.ledger.stopped;
    mine.push_back(patch.id);
    mine.insert(mine.end(), sums.begin(), sums.end());
  }
  const std::vector<double> all = gather_on_first(mine, comm_);
  std::map<int, const double*> by_patch;
  for (std::size_t i = 0; i < all.size(); i += 1 + sum_count) by_patch[static_cast<int>(all[i])] = &all[i + 1];
  Sums sums{};
  for (const auto& [patch, values] : by_patch)
    for (int i = 0; i < sum_count; ++i) sums[i] += values[i];
  Totals t;
  t.kinetic = sums[0], t.strain = sums[1], t.potential = sums[2], t.plastic = sums[3];
  t.contact_dissipation = sums[4], t.boundary_work = sums[5];
  t.momentum = Vec3(sums[6], sums[7], sums[8]);
  t.mass = sums[9], t.contact_nodes = sums[10], t.viscous = sums[11], t.numerical = sums[12];
  t.filtered = sums[13], t.contact_gain = sums[14], t.stopped = sums[15];
  return t;
}

template Totals Simulation<2>::totals() const;
template Totals Simulation<3>::totals() const;

}  // namespace cairn
