#include "cairn/parallel/patch_sums.hpp"
#include "cairn/solver/simulation.hpp"
#include "point_budget.hpp"

namespace cairn {
namespace {

// Of points: mass, that of deformable bodies, kinetic, spin, strain, potential, plastic and viscous energy, momentum,
// stress times volume. Then the ledger, and of crack points: energy stored and dissipated.
constexpr int stress_sums = 11, point_sums = stress_sums + 6, ledger_sums = static_cast<int>(std::size(ledger_columns)),
              crack_sums = 2;
constexpr int sum_count = point_sums + ledger_sums + crack_sums;
using Sums = std::array<double, sum_count>;

template <int Dim>
void add_piece(const Simulation<Dim>& simulation, const Piece<Dim>& piece, Sums& sums) {
  const bool rigid = simulation.is_rigid(piece);
  for_budgets(
      piece, simulation.material_of(piece), rigid, simulation.lattice(), simulation.transfer(), piece.points.size(),
      [](int i) { return i; },
      [&](int, const PointBudget& b) {
        sums[0] += b.mass;
        if (rigid) return;
        const double values[] = {b.mass,    b.kinetic, b.spin,        b.strain,      b.potential,
                                 b.plastic, b.viscous, b.momentum[0], b.momentum[1], b.momentum[2]};
        for (int i = 1; i < stress_sums; ++i) sums[i] += values[i - 1];
      });
  if (rigid) return;
  const auto stress = stress_of_points(piece, simulation.material_of(piece).density);
  for (std::size_t i = 0; i < stress.size(); ++i) sums[stress_sums + i] += stress[i];
}

Totals totals_of(const Sums& sums) {
  Totals t;
  t.mass = sums[0], t.deformable_mass = sums[1], t.kinetic = sums[2], t.strain = sums[4], t.potential = sums[5];
  t.plastic = sums[6], t.viscous = sums[7], t.momentum = Vec3(sums[8], sums[9], sums[10]);
  for (int i = 0; i < ledger_sums; ++i) t.*ledger_columns[i].value = sums[point_sums + i];
  t.crack_energy = sums[sum_count - crack_sums], t.crack_dissipation = sums[sum_count - crack_sums + 1];
  std::copy_n(&sums[stress_sums], t.stress.size(), t.stress.begin());
  t.numerical = t.blended_and_spun - sums[3];
  return t;
}

}  // namespace

template <int Dim>
Totals Simulation<Dim>::totals() const {
  PatchSums<sum_count> all;
  for (const auto& patch : patches_) {
    if (patch.blank()) continue;
    Sums sums{};
    for (const auto& piece : patch.pieces) add_piece(*this, piece, sums);
    for (int i = 0; i < ledger_sums; ++i) sums[point_sums + i] = patch.ledger.*ledger_columns[i].value;
    for (const auto& point : patch.cracks) {
      const auto energies = point.own ? energies_of(point) : std::array<double, crack_sums>{};
      for (int i = 0; i < crack_sums; ++i) sums[sum_count - crack_sums + i] += energies[i];
    }
    all.add(patch.id, sums);
  }
  Totals totals = totals_of(all.on_first(comm_));
  for (double& s : totals.stress) s /= room();
  return totals;
}

template Totals Simulation<2>::totals() const;
template Totals Simulation<3>::totals() const;

}  // namespace cairn
