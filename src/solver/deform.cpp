// A periodic domain that deforms, and all that is in it with it: each of its lengths grows at a given rate, or at one
// that brings the mean stress to a given one, by what is missing of it now and has been missing so far.
//
// Velocities are those beside the homogeneous flow v = L x, so that they are the same at both ends of a period. A
// strain of L dt at the end of a step moves the points with the lattice, strains them all alike, and slows the
// velocities that are left by (1 + L dt)^-1 (the equations of motion of homogeneous flow without its acceleration, as
// SLLOD; Evans & Morriss 1984). Its work is booked as that of the boundary.

#include <fmt/format.h>

#include "cairn/body/deformation.hpp"
#include "cairn/core/error.hpp"
#include "cairn/parallel/patch_sums.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {
namespace {

/// By how much a strain stretches, to the last bit as F of the points has it.
template <int Dim>
Vec<Dim> stretches(const Vec<Dim>& strain) {
  Tensor<Dim, double> A{}, one{};
  for (int d = 0; d < Dim; ++d) A.c[tensor_index<Dim>(d, d)] = strain[d], one.c[tensor_index<Dim>(d, d)] = 1;
  const Tensor<Dim, double> F = advance_deformation(A, one);
  Vec<Dim> stretch;
  for (int d = 0; d < Dim; ++d) stretch[d] = F.c[tensor_index<Dim>(d, d)];
  return stretch;
}

/// Half the work of a strain on a piece's points, by the stress that they have now [J].
template <int Dim>
double half_work(const Points<Dim>& points, const Vec<Dim>& logarithmic) {
  using C = PointColumns<Dim>;
  double work = 0;
  for (int p = 0; p < points.size(); ++p) {
    double power = 0;
    for (int d = 0; d < Dim; ++d) power += points.column(C::stress + d)[p] * logarithmic[d];
    work += 0.5 * points.column(C::volume)[p] * volume_ratio(points, p) * power;
  }
  return work;
}

/// Takes points along with the lattice, each within its cell, and slows them; returns the energy that they get [J].
template <int Dim>
double carry(Points<Dim>& points, const Lattice<Dim>& from, const Lattice<Dim>& to, const Vec<Dim>& factor,
             double density) {
  using C = PointColumns<Dim>;
  double gained = 0;
  for (int p = 0; p < points.size(); ++p) {
    const double half_mass = 0.5 * density * points.column(C::volume)[p];
    for (int d = 0; d < Dim; ++d) {
      double &x = points.column(d)[p], &v = points.column(C::velocity + d)[p];
      const double at = from.scaled(d, x), cell = std::floor(at);
      x = to.lower()[d] + at * to.spacing()[d];
      while (std::floor(to.scaled(d, x)) < cell) x = std::nextafter(x, to.upper()[d]);
      while (std::floor(to.scaled(d, x)) > cell) x = std::nextafter(x, to.lower()[d]);
      const double before = v;
      v /= factor[d];
      gained += half_mass * (v * v - before * before);
    }
  }
  return gained;
}

}  // namespace

template <int Dim>
std::array<double, 6> stress_of_points(const Piece<Dim>& piece, double density) {
  using C = PointColumns<Dim>;
  const Points<Dim>& points = piece.points;
  std::array<double, 6> sum{};
  for (int p = 0; p < points.size(); ++p) {
    const double whole = points.column(C::volume)[p], volume = whole * volume_ratio(points, p);
    for (int i = 0; i < symmetric_size<Dim>; ++i) sum[i] += volume * points.column(C::stress + i)[p];
    for (int i = 0; i < Dim; ++i)
      for (int j = i; j < Dim; ++j)
        sum[symmetric_index<Dim>(i, j)] -=
            density * whole * points.column(C::velocity + i)[p] * points.column(C::velocity + j)[p];
  }
  return sum;
}

template <int Dim>
void Simulation<Dim>::deform() {
  if (!deformation_.active()) return;
  rates_ = strain_rates();
  deform_by(dt_ * rates_);
}

template <int Dim>
std::array<double, 6> Simulation<Dim>::mean_stress() const {
  PatchSums<6> sums;
  for (const auto& patch : patches_) {
    std::array<double, 6> sum{};
    for (const auto& piece : patch.pieces) {
      if (is_rigid(piece)) continue;
      const auto part = stress_of_points(piece, material_of(piece).density);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += part[i];
    }
    if (patch.point_count() > 0) sums.add(patch.id, sum);
  }
  auto stress = sums.on_all(comm_);
  for (double& s : stress) s /= room();
  return stress;
}

template <int Dim>
Vec<Dim> Simulation<Dim>::strain_rates() {
  using By = AxisDeformation::By;
  const auto by_stress = [](const AxisDeformation& axis) { return axis.by == By::stress; };
  const auto stress = std::ranges::any_of(deformation_.axes, by_stress) ? mean_stress() : std::array<double, 6>{};
  Vec<Dim> rates = Vec<Dim>::Zero();
  for (int d = 0; d < Dim; ++d) {
    const AxisDeformation& axis = deformation_.axes[d];
    if (!axis.active()) continue;
    rates[d] = axis.target.at(time_).x();
    if (!by_stress(axis)) continue;
    const double wanted = (rates[d] - stress[d]) / axis.viscosity;
    const double needed = needed_rates_[d] + dt_ / axis.memory * wanted;
    rates[d] = std::clamp(wanted + needed, -axis.largest_rate, axis.largest_rate);
    if (rates[d] == wanted + needed) needed_rates_[d] = needed;
  }
  return rates;
}

template <int Dim>
void Simulation<Dim>::deform_by(const Vec<Dim>& strain) {
  const auto time = timers_.measure(Stage::stress);
  constexpr double most = 0.1;  // in a step
  if (!(strain.cwiseAbs().maxCoeff() < most))
    throw RunError(fmt::format("step {}: the domain deforms by {:.3g} in one step; let domain.deform be slower", steps_,
                               strain.cwiseAbs().maxCoeff()));
  const Vec<Dim> factor = stretches(strain), logarithmic = factor.array().log().matrix().eval();
  const Lattice<Dim> before = lattice_;
  place_corner(lattice_.lower() + (lattice_.upper() - lattice_.lower()).cwiseProduct(factor));
  SpeedLimits unused;  // the next step's stresses see to it
  for (auto& patch : patches_)
    for (auto& piece : patch.pieces) {
      const SolverMaterial& material = material_of(piece);
      double work = carry(piece.points, before, lattice_, factor, material.density);
      work += half_work(piece.points, logarithmic);
      strain_alike(piece, material.law, material.density, strain, dt_, unused);
      work += half_work(piece.points, logarithmic);
      patch.ledger.boundary_work += work;
      piece.projected = false;
    }
}

/// The lattice, and the faces of the domain with it.
template <int Dim>
void Simulation<Dim>::place_corner(const Vec<Dim>& upper) {
  lattice_.set_upper(upper);
  for (int face = 0; face < 2 * Dim; ++face)
    for (int d = 0; d < Dim; ++d)
      if (lattice_.periodic(d)) tools_[face].centre[d] = 0.5 * (lattice_.lower()[d] + lattice_.upper()[d]);
  place_walls();
}

#define CAIRN_INSTANTIATE(Dim)                                                \
  template std::array<double, 6> stress_of_points(const Piece<Dim>&, double); \
  template std::array<double, 6> Simulation<Dim>::mean_stress() const;        \
  template void Simulation<Dim>::deform();                                    \
  template Vec<Dim> Simulation<Dim>::strain_rates();                          \
  template void Simulation<Dim>::deform_by(const Vec<Dim>&);                  \
  template void Simulation<Dim>::place_corner(const Vec<Dim>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
