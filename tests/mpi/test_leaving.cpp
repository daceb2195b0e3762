// Points that leave the domain through free faces, and lost ones that are dropped: every book closes, on any number of
// ranks alike.

#include <gtest/gtest.h>

#include <cmath>

#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"
#include "cairn/core/error.hpp"
#include "cairn/solver/energy_book.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double forever = 1e300;

/// A spinning ball that flies out of a corner of the domain and one that stays.
Case leaving_ball(int dimension) {
  Case c = soft_case(dimension, 16, 4);
  const double z = dimension == 3 ? 1 : 0;
  add_body(c, Ball{Vec3(0.75, 0.7, 0.5 * z), 0.2}, Vec3(1.5, 1, 0.1 * z), Vec3(0, 0, 3));
  add_body(c, Ball{Vec3(0.3, 0.3, 0.5 * z), 0.2}, Vec3(0.2, 0.1, 0), Vec3(0.5 * z, 0, -2));
  c.domain.gravity = Vec3(0, -0.2, 0);
  return c;
}

/// What left and what is there, as numbers that must be the same on any number of ranks.
std::vector<double> numbers_of(const Totals& t) {
  std::vector<double> numbers = {t.mass, t.kinetic, t.strain, t.potential, t.numerical, t.momentum[0], t.momentum[1]};
  for (const auto& column : ledger_columns) numbers.push_back(t.*column.value);
  return numbers;
}

template <int Dim>
std::vector<double> totals_after(const Case& c, int steps, MPI_Comm comm) {
  Simulation<Dim> simulation(c, comm);
  for (int i = 0; i < steps; ++i) simulation.step(forever);
  simulation.step_state();
  return numbers_of(simulation.totals());
}

template <int Dim>
void check_books(const Case& c, int steps, double tolerance) {
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const Totals start = simulation.totals();
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  EnergyBook book;
  double time = 0;
  for (int i = 0; i < steps; ++i) {
    if (i % 10 == 0) {
      const Totals t = simulation.totals();
      if (rank == 0) {
        book.add(t);
        ASSERT_NEAR(t.mass + t.mass_left, start.mass, 1e-12 * start.mass);
        ASSERT_LE(std::abs(book.error()), tolerance) << "step " << i;
        // Nothing but gravity, which pulls what is left, and contact, which passes momentum on, acts: the momentum
        // across gravity stays.
        ASSERT_NEAR(t.momentum[0] + t.momentum_left_x, start.momentum[0], 1e-12 * start.momentum[0]);
        ASSERT_NEAR(t.momentum[2] + t.momentum_left_z, start.momentum[2], 1e-12 * start.momentum[0]);
      }
    }
    simulation.step(forever);
    time += simulation.dt();
  }
  const Totals t = simulation.totals();
  if (rank != 0) return;
  EXPECT_GT(time, 0.5);
  EXPECT_GT(t.points_left, 100);
  EXPECT_NEAR(t.mass_left, 0.5 * start.mass, 0.02 * start.mass);  // the whole of the first ball
  EXPECT_EQ(t.points_lost, 0);
}
TEST(Leaving, EveryBookCloses2D) { check_books<2>(leaving_ball(2), 200, 2e-3); }
TEST(Leaving, EveryBookCloses3D) { check_books<3>(leaving_ball(3), 200, 2e-3); }

TEST(Leaving, TheSameOnAnyNumberOfRanks) {
  for (StressUpdate update :
       {StressUpdate::last, StressUpdate::first, StressUpdate::both, StressUpdate::modified_last}) {
    Case c = leaving_ball(2);
    c.solver.stress_update = update;
    const auto alone = totals_after<2>(c, 200, MPI_COMM_SELF), together = totals_after<2>(c, 200, MPI_COMM_WORLD);
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    if (rank != 0) continue;
    EXPECT_EQ(alone, together) << static_cast<int>(update);
  }
}

TEST(Leaving, AFaceThatStopsEndsTheRun) {
  Case c = leaving_ball(2);
  for (auto& face : c.faces) face.leaving = Leaving::stop;
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  const auto fly = [&] {
    for (int i = 0; i < 400; ++i) simulation.step(forever);
  };
  EXPECT_THROW(fly(), RunError);
}

/// The last body out ends nothing.
TEST(Leaving, ADomainWithoutPointsGoesOn) {
  Case c = leaving_ball(2);
  c.bodies.pop_back();
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  for (int i = 0; i < 600; ++i) simulation.step(0.01);
  const Totals t = simulation.totals();
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  EXPECT_EQ(t.mass, 0) << rank;
}

/// A point that is turned inside out by hand ends the run, or is dropped and takes its mass along.
template <int Dim>
void check_dropped(StressUpdate update, LostPoints lost_points) {
  Case c = leaving_ball(Dim);
  c.solver.stress_update = update, c.solver.lost_points = lost_points;
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const Totals start = simulation.totals();
  for (int i = 0; i < 5; ++i) simulation.step(forever);
  simulation.step_state();
  double mass = 0;
  for (auto& patch : simulation.patches())
    for (auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p)
        if (piece.points.ids()[p] == 40) {
          piece.points.column(PointColumns<Dim>::deformation)[p] *= -1;
          mass = 1000 * piece.points.column(PointColumns<Dim>::volume)[p];
        }
  MPI_Allreduce(MPI_IN_PLACE, &mass, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  ASSERT_GT(mass, 0);
  std::size_t notes = 0;
  const auto go_on = [&] {
    for (int i = 0; i < 6; ++i) simulation.step(forever), notes += simulation.take_notes().size();
    simulation.step_state();
  };
  if (lost_points == LostPoints::stop) {
    EXPECT_THROW(go_on(), RunError);
    return;
  }
  ASSERT_NO_THROW(go_on());
  const Totals t = simulation.totals();
  MPI_Allreduce(MPI_IN_PLACE, &notes, 1, MPI_UNSIGNED_LONG, MPI_SUM, MPI_COMM_WORLD);
  EXPECT_EQ(notes, 1U);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank != 0) return;
  EXPECT_EQ(t.points_lost, 1);
  EXPECT_EQ(t.points_left, 0);
  EXPECT_DOUBLE_EQ(t.mass_left, mass);
  EXPECT_NEAR(t.mass + t.mass_left, start.mass, 1e-12 * start.mass);
  EXPECT_NEAR(t.momentum[0] + t.momentum_left_x, start.momentum[0], 1e-12 * start.momentum[0]);
  EXPECT_TRUE(std::isfinite(t.energy()));
}
TEST(Leaving, AnInvertedPointEndsTheRunOrIsDropped) {
  for (StressUpdate update : {StressUpdate::last, StressUpdate::first, StressUpdate::both, StressUpdate::modified_last})
    for (LostPoints lost : {LostPoints::stop, LostPoints::drop}) {
      SCOPED_TRACE(testing::Message() << "update " << static_cast<int>(update) << ", " << static_cast<int>(lost));
      check_dropped<2>(update, lost);
      check_dropped<3>(update, lost);
    }
}

}  // namespace
}  // namespace cairn
