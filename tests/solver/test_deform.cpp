// A periodic domain that deforms, and all that is in it.

#include <gtest/gtest.h>

#include <cmath>

#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"
#include "cairn/solver/energy_book.hpp"

namespace cairn {
namespace {

using namespace test;
using By = AxisDeformation::By;

constexpr double forever = 1e300;

template <int Dim>
Case periodic_case(int cells) {
  Case c = soft_case(Dim, cells, 4);
  c.domain.lower = Vec3(-0.3, 0.2, Dim == 3 ? 0.1 : 0);
  c.domain.upper += c.domain.lower;
  for (int d = 0; d < Dim; ++d) c.domain.periodic[d] = true;
  return c;
}

/// One body that fills the domain.
template <int Dim>
Case filled_case(int cells) {
  Case c = periodic_case<Dim>(cells);
  add_body(c, BoxShape{c.domain.lower, c.domain.upper});
  return c;
}

/// Cauchy stress of the law of soft_case at F = diag(stretch), from its energy: dW / d ln(stretch) / J by differences.
template <int Dim>
Vec3 neo_hookean(const Vec3& stretch) {
  const Law law = make_law("neo_hookean", {{"shear_modulus", 4e3}, {"bulk_modulus", soft_bulk}}, Plane::strain);
  const auto energy = [&](const Vec3& s) {
    Tensor<Dim, double> F{};
    for (int i = 0; i < Dim; ++i) F.c[tensor_index<Dim>(i, i)] = s[i];
    if constexpr (Dim == 2) F.c[4] = 1;  // zz
    const std::array<double, state_capacity> state{};
    return std::visit([&](const auto& l) { return l.strain_energy(F, state.data()); }, law);
  };
  Vec3 stress = Vec3::Zero();
  for (int i = 0; i < Dim; ++i) {
    const double step = 1e-5;
    Vec3 more = stretch, less = stretch;
    more[i] *= std::exp(step), less[i] *= std::exp(-step);
    stress[i] = (energy(more) - energy(less)) / (2 * step) / stretch.prod();
  }
  return stress;
}

template <int Dim>
void check_filled(StressUpdate update) {
  Case c = filled_case<Dim>(8);
  c.solver.stress_update = update;
  c.domain.deformation.axes[0] = {By::strain_rate, MotionTable(Vec3(-0.4, 0, 0))};
  c.domain.deformation.axes[1] = {By::strain_rate, MotionTable(Vec3(0.2, 0, 0))};
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const auto before = points_of(simulation);
  EnergyBook book(0);
  Vec3 stretch(1, 1, 1);
  for (int i = 0; i < 60; ++i) {
    book.add(simulation.totals());
    simulation.step(forever);
    for (int d = 0; d < Dim; ++d) stretch[d] = simulation.lattice().length(d);
  }
  const Totals totals = simulation.totals();
  book.add(totals);
  EXPECT_NEAR(stretch[0], std::exp(-0.4 * simulation.time()), 1e-5);
  EXPECT_NEAR(stretch[1], std::exp(0.2 * simulation.time()), 1e-5);
  EXPECT_EQ(stretch[2], 1);
  EXPECT_LT(stretch[0], 0.97);
  const Vec3 expected = neo_hookean<Dim>(stretch);
  for (int d = 0; d < Dim; ++d) {
    EXPECT_NEAR(totals.stress[d], expected[d], 1e-5 * soft_bulk);
  }
  EXPECT_LT(totals.kinetic, 1e-12 * totals.strain);
  EXPECT_NEAR(totals.boundary_work, totals.strain, 2e-3 * totals.strain);
  EXPECT_LT(std::abs(book.error()), 2e-3);
  for (const auto& [id, point] : points_of(simulation)) {
    const auto& was = before.at(id);
    for (int d = 0; d < Dim; ++d) {
      const double low = c.domain.lower[d];
      EXPECT_NEAR(point.x[d] - low, stretch[d] * (was.x[d] - low), 1e-12);
      EXPECT_NEAR(point.F.c[tensor_index<Dim>(d, d)], stretch[d], 1e-12);
    }
  }
}

TEST(Deform, AFilledDomainHasTheStressOfItsStrain2D) {
  for (StressUpdate update : {StressUpdate::last, StressUpdate::first, StressUpdate::both, StressUpdate::modified_last})
    check_filled<2>(update);
}
TEST(Deform, AFilledDomainHasTheStressOfItsStrain3D) { check_filled<3>(StressUpdate::both); }

/// Nothing moves but the domain: the mean flow of its bodies is its own.
TEST(Deform, TheMeanFlowIsThatOfTheDomain) {
  Case c = filled_case<2>(8);
  c.domain.deformation.axes[0] = {By::strain_rate, MotionTable(Vec3(-0.3, 0, 0))};
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  for (int i = 0; i < 3; ++i) simulation.step(forever);
  EXPECT_NEAR(simulation.totals().velocity_gradient(0, 0), -0.3, 1e-9);
}

TEST(Deform, ABodyThatFliesSlowsAsItsWayStretches) {
  Case c = periodic_case<2>(16);
  add_body(c, Ball{Vec3(0.1, 0.6, 0), 0.2}, Vec3(0.7, 0.3, 0));
  c.domain.deformation.axes[0] = {By::strain_rate, MotionTable(Vec3(0.5, 0, 0))};
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  const Vec3 start = simulation.totals().momentum;
  for (int i = 0; i < 100; ++i) simulation.step(forever);
  const double stretch = simulation.lattice().length(0);
  EXPECT_GT(stretch, 1.02);
  const Vec3 end = simulation.totals().momentum;
  EXPECT_NEAR(end.x(), start.x() / stretch, 1e-9 * start.norm());
  EXPECT_NEAR(end.y(), start.y(), 1e-12 * start.norm());
}

TEST(Deform, AStressIsReachedAndHeld) {
  for (const double target : {-400.0, 200.0}) {
    Case c = filled_case<2>(8);
    const double wave = std::sqrt((soft_bulk + 4.0 / 3 * 4e3) / 1000);
    c.domain.deformation.axes[1] = {By::stress, MotionTable(Vec3(target, 0, 0)), 1000 * wave / 2, 100.0 / 8 / wave,
                                    0.3};
    Simulation<2> simulation(c, MPI_COMM_WORLD);
    double furthest = 0;
    for (int i = 0; i < 1500; ++i) {
      simulation.step(forever);
      furthest = std::max(furthest, simulation.mean_stress()[1] / target);
    }
    EXPECT_NEAR(simulation.mean_stress()[1], target, 1e-3 * std::abs(target));
    EXPECT_LT(furthest, 1.05);
    EXPECT_EQ(simulation.lattice().length(0), 1);
    EXPECT_NEAR(simulation.mean_stress()[1], neo_hookean<2>(Vec3(1, simulation.lattice().length(1), 1))[1],
                1e-3 * std::abs(target));
  }
}

/// Disks pressed together: energy and momentum stay in their books, and no disk leaves its neighbours.
TEST(Deform, BooksOfGrainsThatArePressedClose) {
  Case c = periodic_case<2>(24);
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      add_body(c, Ball{c.domain.lower + Vec3(0.26 + 0.5 * i, 0.24 + 0.5 * j, 0), 0.24}, Vec3(0.2 - 0.4 * j, 0, 0));
  c.contact.friction = 0.3;
  c.domain.deformation.axes[0] = {By::strain_rate, MotionTable(Vec3(-0.2, 0, 0))};
  c.domain.deformation.axes[1] = {By::strain_rate, MotionTable(Vec3(-0.2, 0, 0))};
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  EnergyBook book(0);
  for (int i = 0; i < 400; ++i) {
    if (i % 20 == 0) book.add(simulation.totals());
    simulation.step(forever);
  }
  const Totals totals = simulation.totals();
  book.add(totals);
  EXPECT_LT(simulation.lattice().length(0), 0.9);
  EXPECT_LT(totals.stress[0], -50);
  EXPECT_LT(totals.stress[1], -50);
  EXPECT_LT(std::abs(book.error()), 0.02);
  EXPECT_LT(totals.momentum.norm(), 1e-12);
  EXPECT_LE(totals.contact_gain, 1e-12);
}

}  // namespace
}  // namespace cairn
