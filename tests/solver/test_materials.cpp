// Materials in whole steps: initial pressure, plane stress, and where viscous dissipation is booked.

#include <gtest/gtest.h>

#include <cmath>

#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"
#include "cairn/solver/energy_book.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double forever = 1e300;
const ParameterValues moduli = {{"shear_modulus", 4e3},   {"bulk_modulus", soft_bulk}, {"yield_stress", 1e2},
                                {"hardening_modulus", 0}, {"branch_moduli.0", 2e3},    {"branch_times.0", 0.02}};

Case one_block(int dimension, const std::string& model) {
  Case c = soft_case(dimension, dimension == 2 ? 20 : 10, 5);
  c.materials[0].model = model, c.materials[0].parameters = moduli;
  const double z = dimension == 3 ? 1 : 0;
  add_body(c, BoxShape{Vec3(0.3, 0.3, 0.3 * z), Vec3(0.7, 0.6, 0.7 * z), 0.0});
  return c;
}

template <int Dim>
void check_pressure(const std::string& model, double pressure) {
  Case c = one_block(Dim, model);
  c.bodies[0].initial_pressure = pressure;
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const double volume = 0.4 * 0.3 * (Dim == 3 ? 0.4 : 1.0);  // as placed
  const Totals start = simulation.totals();
  double now = 0;
  for (const auto& [id, point] : points_of(simulation)) now += point.mass / 1000 * determinant(point.F);
  EXPECT_NEAR(now, volume, 1e-12 * volume);
  // Mass: the density belongs to the stress-free body, which is larger than the pressed one.
  const double ratio = model == "hypoelastic" || model == "von_mises"
                           ? std::exp(-pressure / soft_bulk)
                           : std::sqrt(1 + std::pow(pressure / soft_bulk, 2)) - pressure / soft_bulk;
  EXPECT_NEAR(start.mass, 1000 * volume / ratio, 1e-11 * start.mass);
  EXPECT_NEAR(start.strain, 0.5 * pressure * pressure / soft_bulk * volume,
              std::abs(pressure) / soft_bulk * start.strain);
  EXPECT_GT(start.strain, 0);
  // A step of almost no time: the law finds the same stress from what it was given.
  simulation.step(1e-12);
  for (const auto& [id, point] : points_of(simulation))
    for (int i = 0; i < symmetric_size<Dim>; ++i)
      ASSERT_NEAR(point.stress.c[i], i < 3 ? -pressure : 0.0, 1e-8 * std::abs(pressure)) << model;
}
TEST(InitialPressure, IsTheStressOfEveryPoint) {
  for (const char* model : {"neo_hookean", "hypoelastic", "von_mises", "viscoelastic"})
    for (double pressure : {800.0, -800.0}) {
      check_pressure<2>(model, pressure);
      check_pressure<3>(model, pressure);
    }
}

/// Let go, a pressed block breathes: its strain energy becomes motion, and the book closes.
TEST(InitialPressure, EnergyOfAFreeBlockIsKept) {
  for (const char* model : {"neo_hookean", "hypoelastic"}) {
    Case c = one_block(2, model);
    c.bodies[0].initial_pressure = 300;
    Simulation<2> simulation(c, MPI_COMM_WORLD);
    EnergyBook book;
    book.add(simulation.totals());
    const double given = simulation.totals().strain;
    double kinetic = 0, worst = 0;
    for (int i = 0; i < 300; ++i) {
      simulation.step(forever);
      const Totals t = simulation.totals();
      book.add(t);
      kinetic = std::max(kinetic, t.kinetic), worst = std::max(worst, std::abs(book.error()));
    }
    EXPECT_GT(kinetic, 0.3 * given);
    EXPECT_LT(worst, 0.02) << model;
  }
}

TEST(PlaneStress, SigmaZZStaysZeroAndTheMassIsKept) {
  for (const char* model : {"neo_hookean", "hypoelastic", "von_mises", "viscoelastic"}) {
    Case c = colliding_balls(2, 24, 6);
    c.materials[0].model = model, c.materials[0].parameters = moduli, c.materials[0].plane = Plane::stress;
    Simulation<2> simulation(c, MPI_COMM_WORLD);
    EnergyBook book;
    book.add(simulation.totals());
    const double mass = simulation.totals().mass;
    double thinnest = 1, thickest = 1, across = 0, worst = 0;
    for (int i = 0; i < 150; ++i) {
      simulation.step(forever);
      for (const auto& [id, point] : points_of(simulation)) {
        thinnest = std::min(thinnest, point.F.c[4]), thickest = std::max(thickest, point.F.c[4]);
        across = std::max(across, std::abs(point.stress.c[2]));
      }
      book.add(simulation.totals());
      worst = std::max(worst, std::abs(book.error()));
    }
    EXPECT_LE(across, 1e-11 * soft_bulk) << model;
    EXPECT_GT(thickest, 1.01) << model;
    EXPECT_LT(thinnest, 0.999) << model;
    EXPECT_NEAR(simulation.totals().mass, mass, 1e-13 * mass);
    EXPECT_LT(worst, 0.02) << model;
  }
}

TEST(Viscoelastic, DissipationIsInTheBook) {
  for (StressUpdate update : {StressUpdate::both, StressUpdate::modified_last}) {
    Case c = colliding_balls(2, 24, 6);
    c.solver.stress_update = update;
    c.materials[0].model = "viscoelastic", c.materials[0].parameters = moduli;
    Simulation<2> simulation(c, MPI_COMM_WORLD);
    EnergyBook book;
    book.add(simulation.totals());
    const double start = simulation.totals().kinetic;
    double before = 0, worst = 0;
    for (int i = 0; i < 200; ++i) {
      simulation.step(forever);
      const Totals t = simulation.totals();
      ASSERT_GE(t.viscous, before);
      before = t.viscous;
      book.add(t);
      worst = std::max(worst, std::abs(book.error()));
    }
    EXPECT_GT(before, 0.05 * start);
    EXPECT_LT(worst, 0.02);
  }
}

}  // namespace
}  // namespace cairn
