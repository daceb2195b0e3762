#include <Eigen/Dense>

#include "cairn/parallel/patch_sums.hpp"
#include "cairn/solver/simulation.hpp"
#include "point_budget.hpp"

namespace cairn {
namespace {

// Of points: mass, that of deformable bodies, kinetic, spin, strain, potential, plastic and viscous energy, momentum,
// stress times volume, flow. Then the ledger, and of crack points: energy stored and dissipated.
constexpr int stress_sums = 11, flow_sums = stress_sums + 6, flow_width = 22, point_sums = flow_sums + flow_width,
              ledger_sums = static_cast<int>(std::size(ledger_columns)), crack_sums = 2;
constexpr int sum_count = point_sums + ledger_sums + crack_sums;
using Sums = std::array<double, sum_count>;

/// The volume, m x, m x (x) x, m v (x) x of a piece's points, x from a place near bodies.
template <int Dim>
void add_flow(const Piece<Dim>& piece, double density, const Vec3& origin, double* sums) {
  using C = PointColumns<Dim>;
  const Points<Dim>& points = piece.points;
  for (int p = 0; p < points.size(); ++p) {
    const double volume = points.column(C::volume)[p], mass = density * volume;
    sums[0] += volume * volume_ratio(points, p);
    for (int i = 0; i < Dim; ++i) {
      const double moment = mass * (points.column(i)[p] - origin[i]);
      sums[1 + i] += moment;
      for (int j = 0; j < Dim; ++j) {
        sums[4 + 3 * i + j] += moment * (points.column(j)[p] - origin[j]);
        sums[13 + 3 * j + i] += moment * points.column(C::velocity + j)[p];
      }
    }
  }
}

/// By least squares; of least size where all points lie on a line.
Eigen::Matrix3d gradient_of(double mass, const Vec3& momentum, const double* flow) {
  if (!(mass > 0)) return Eigen::Matrix3d::Zero();
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Vec3 middle = Eigen::Map<const Vec3>(flow + 1) / mass;
  const Eigen::Matrix3d spread = Eigen::Map<const Matrix>(flow + 4) - mass * middle * middle.transpose(),
                        moving = Eigen::Map<const Matrix>(flow + 13) - momentum * middle.transpose();
  return spread.completeOrthogonalDecomposition().solve(moving.transpose()).transpose();
}

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
  add_flow(piece, simulation.material_of(piece).density, simulation.bodies()[0].centre, &sums[flow_sums]);
}

Totals totals_of(const Sums& sums) {
  Totals t;
  t.mass = sums[0], t.deformable_mass = sums[1], t.kinetic = sums[2], t.strain = sums[4], t.potential = sums[5];
  t.plastic = sums[6], t.viscous = sums[7], t.momentum = Vec3(sums[8], sums[9], sums[10]);
  for (int i = 0; i < ledger_sums; ++i) t.*ledger_columns[i].value = sums[point_sums + i];
  t.crack_energy = sums[sum_count - crack_sums], t.crack_dissipation = sums[sum_count - crack_sums + 1];
  t.deformable_volume = sums[flow_sums];
  t.velocity_gradient = gradient_of(t.deformable_mass, t.momentum, &sums[flow_sums]);
  std::copy_n(&sums[stress_sums], t.stress.size(), t.stress.begin());
  t.numerical = t.blended_and_spun - sums[3];
  return t;
}

}  // namespace

double shear_rate(const Eigen::Matrix3d& velocity_gradient, int dimension) {
  Eigen::MatrixXd rate = velocity_gradient.topLeftCorner(dimension, dimension);
  rate = 0.5 * (rate + rate.transpose()).eval();
  rate.diagonal().array() -= rate.trace() / dimension;
  return std::sqrt(2) * rate.norm();
}

double inertial_number(const Totals& totals, std::int64_t bodies, int dimension) {
  const double pressure = -(totals.stress[0] + totals.stress[1] + (dimension == 3 ? totals.stress[2] : 0)) / dimension;
  if (!(pressure > 0) || bodies == 0 || !(totals.deformable_volume > 0)) return 0;
  const double each = totals.deformable_volume / static_cast<double>(bodies);
  const double diameter = dimension == 2 ? 2 * std::sqrt(each / M_PI) : std::cbrt(6 * each / M_PI);
  return shear_rate(totals.velocity_gradient, dimension) * diameter *
         std::sqrt(totals.deformable_mass / totals.deformable_volume / pressure);
}

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
  for (int d = 0; d < Dim; ++d) totals.velocity_gradient(d, d) += rates_[d];  // velocities are those beside them
  return totals;
}

template Totals Simulation<2>::totals() const;
template Totals Simulation<3>::totals() const;

}  // namespace cairn
