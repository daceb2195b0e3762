#pragma once
/// What one point adds to the sums over everything.

#include "cairn/body/deformation.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {

struct PointBudget {
  double mass = 0;               // [kg]
  double kinetic = 0, spin = 0;  // [J]; spin: the part of kinetic that turns about the point
  double strain = 0, potential = 0, plastic = 0, viscous = 0;  // [J]
  Vec3 momentum = Vec3::Zero();                                // [kg m/s]
  double energy() const { return kinetic + strain + potential + plastic + viscous; }
};

/// Calls f(point, budget) for the points of a piece, which `which(i)` names for i from 0 to count - 1. Of a rigid
/// body's points only the mass counts.
template <int Dim, class Which, class Visit>
void for_budgets(const Piece<Dim>& piece, const SolverMaterial& material, bool rigid, const Lattice<Dim>& lattice,
                 const TransferSettings<Dim>& transfer, int count, Which&& which, Visit&& f) {
  using C = PointColumns<Dim>;
  const Points<Dim>& points = piece.points;
  const auto inertia = spin_inertia(piece, lattice, transfer);
  std::visit(
      [&](const auto& law) {
        std::array<double, state_capacity> state{};
        for (int i = 0; i < count; ++i) {
          const int p = which(i);
          PointBudget b;
          const double volume = points.column(C::volume)[p];
          b.mass = material.density * volume;
          if (rigid) {
            f(p, b);
            continue;
          }
          for (int s = 0; s < points.columns() - C::state; ++s) state[s] = points.column(C::state + s)[p];
          double squared = 0, height = 0, spin = 0;
          for (int d = 0; d < Dim; ++d) {
            const double v = points.column(C::velocity + d)[p];
            squared += v * v;
            height += transfer.gravity[d] * (points.column(d)[p] + points.images()[p][d] * lattice.length(d));
            b.momentum[d] = b.mass * v;
          }
          for (int s = 0; s < spin_size<Dim>; ++s) spin += inertia[p][s] * std::pow(points.column(C::spin + s)[p], 2);
          b.kinetic = 0.5 * b.mass * (squared + spin);
          b.spin = 0.5 * b.mass * spin;
          b.strain = volume * law.strain_energy(deformation_of(points, p), state.data());
          b.potential = -b.mass * height;
          b.plastic = volume * law.plastic_work(state.data());
          if constexpr (requires { law.viscous_dissipation(state.data()); })
            b.viscous = volume * law.viscous_dissipation(state.data());
          f(p, b);
        }
      },
      material.law);
}

}  // namespace cairn
