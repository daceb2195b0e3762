// The filter of motion that no node sees: what it leaves as it is, what it takes, and that the book knows.

#include <gtest/gtest.h>

#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"
#include "../support/random.hpp"
#include "cairn/solver/body_states.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double forever = 1e300;

/// Two balls that never meet, in steps too short for anything but the filter to act: with `xpic` it takes all at a
/// step.
template <int Dim>
Case still_case(NoiseFilter filter, int order = 4) {
  Case c = colliding_balls(Dim, Dim == 2 ? 24 : 12, Dim == 2 ? 6 : 4);
  c.bodies[1].shape = Ball{Vec3(0.82, 0.84, Dim == 3 ? 0.8 : 0), 0.13};
  c.time.dt = 1e-12;
  c.solver.noise_filter = filter, c.solver.noise_order = order;
  return c;
}

template <int Dim>
void add_noise(Simulation<Dim>& simulation, double size) {
  using C = PointColumns<Dim>;
  Random random(4);
  for (auto& patch : simulation.patches())
    for (auto& piece : patch.pieces)
      for (int c = C::velocity; c < C::deformation; ++c)
        for (int p = 0; p < piece.points.size(); ++p) piece.points.column(c)[p] += random(-size, size);
}

template <int Dim>
void check_conservation() {
  Simulation<Dim> simulation(still_case<Dim>(NoiseFilter::xpic), MPI_COMM_WORLD);
  simulation.step(forever);
  add_noise(simulation, 1);
  const Totals before = simulation.totals();
  const auto bodies = body_states(simulation);
  simulation.step(forever);
  const Totals after = simulation.totals();
  const double taken = after.filtered - before.filtered;
  EXPECT_GT(taken, 0.3 * before.kinetic) << "most of the noise is not seen";
  EXPECT_NEAR(before.kinetic - after.kinetic, taken, 1e-9 * taken);
  EXPECT_NEAR(after.numerical, before.numerical, 1e-9 * taken);
  EXPECT_LE((after.momentum - before.momentum).norm(), 1e-13 * std::sqrt(before.kinetic * before.mass));
  const auto now = body_states(simulation);
  ASSERT_EQ(now.size(), bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    EXPECT_LE((now[b].velocity - bodies[b].velocity).norm(), 1e-13);
    EXPECT_LE((now[b].angular_momentum - bodies[b].angular_momentum).norm(), 1e-11 * before.mass);
  }
}
TEST(NoiseFilter, TakesEnergyAndLeavesMomentumAndAngularMomentum) {
  check_conservation<2>();
  check_conservation<3>();
}

template <int Dim>
void check_rigid_motion() {
  Simulation<Dim> simulation(still_case<Dim>(NoiseFilter::xpic), MPI_COMM_WORLD);
  const auto start = points_of(simulation);
  for (int i = 0; i < 5; ++i) simulation.step(forever);
  const Totals t = simulation.totals();
  EXPECT_LE(std::abs(t.filtered), 1e-13 * t.kinetic);
  for (const auto& [id, point] : points_of(simulation)) EXPECT_LE((point.v - start.at(id).v).norm(), 1e-9);
}
TEST(NoiseFilter, LeavesRigidMotionsAlone) {
  check_rigid_motion<2>();
  check_rigid_motion<3>();
}

/// (1 - S+ S)^a and then (1 - S+ S)^b leave of the noise what goes last: the higher the order, the less is taken.
TEST(NoiseFilter, HigherOrdersTakeLess) {
  double last = std::numeric_limits<double>::infinity();
  for (int order : {1, 2, 4, 8}) {
    Simulation<2> simulation(still_case<2>(NoiseFilter::xpic, order), MPI_COMM_WORLD);
    simulation.step(forever);
    add_noise(simulation, 1);
    simulation.step(forever);
    const double taken = simulation.totals().filtered;
    EXPECT_GT(taken, 0);
    EXPECT_LT(taken, last);
    last = taken;
  }
}

/// In a body that flies and vibrates the weak filter takes a part of the noise, and energy is neither made nor lost.
TEST(NoiseFilter, ClosesTheBookInFlight) {
  for (const auto& [filter, least] :
       {std::pair(NoiseFilter::off, 0.0), {NoiseFilter::weak, 0.05}, {NoiseFilter::strong, 0.3}}) {
    Case c = still_case<2>(filter);
    c.time.dt = 0;
    Simulation<2> simulation(c, MPI_COMM_WORLD);
    add_noise(simulation, 0.05);
    const Totals before = simulation.totals();
    for (int i = 0; i < 100; ++i) simulation.step(forever);
    const Totals after = simulation.totals();
    const double noise = 0.5 * before.mass * 0.05 * 0.05 / 3 * 2;
    EXPECT_NEAR(after.energy(), before.energy(), 0.02 * noise) << static_cast<int>(filter);
    EXPECT_GE(after.filtered, least * noise) << static_cast<int>(filter);
    if (filter == NoiseFilter::off) {
      EXPECT_EQ(after.filtered, 0);
    }
  }
}

}  // namespace
}  // namespace cairn
