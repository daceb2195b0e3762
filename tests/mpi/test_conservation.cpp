// Collisions on any number of ranks: momentum stays, and every bit is that of one rank.

#include <gtest/gtest.h>
#include <mpi.h>

#include "../support/cases.hpp"

namespace cairn {
namespace {

using namespace test;

template <int Dim>
void expect_same_points(const Simulation<Dim>& shared, const Simulation<Dim>& alone) {
  const auto all = points_of(alone);
  const auto mine = points_of(shared);
  for (const auto& [id, a] : mine) {
    const auto& b = all.at(id);
    ASSERT_EQ(a.body, b.body);
    ASSERT_EQ(a.x, b.x);
    ASSERT_EQ(a.v, b.v);
    for (int i = 0; i < tensor_size<Dim>; ++i) ASSERT_EQ(a.F.c[i], b.F.c[i]);
    for (int i = 0; i < symmetric_size<Dim>; ++i) ASSERT_EQ(a.stress.c[i], b.stress.c[i]);
  }
  std::int64_t count = static_cast<std::int64_t>(mine.size());
  MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  EXPECT_EQ(count, static_cast<std::int64_t>(all.size()));
}

template <int Dim>
void check_collision(Case c, int steps) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  c.parallel.balance_every = 10, c.parallel.imbalance = 1.01;  // with METIS patches move during the run
  for (Partition partition : {Partition::metis, Partition::round_robin}) {
    c.parallel.partition = partition;
    Simulation<Dim> shared(c, MPI_COMM_WORLD), alone(c, MPI_COMM_SELF);
    const Totals start = shared.totals();
    for (int i = 0; i < steps; ++i) shared.step(1e300), alone.step(1e300);
    EXPECT_EQ(shared.time(), alone.time());
    expect_same_points(shared, alone);
    const Totals now = shared.totals(), reference = alone.totals();
    if (rank != 0) continue;  // where totals are valid
    EXPECT_LE((now.momentum - start.momentum).norm(), 1e-12 * start.mass * 0.3);
    EXPECT_GT(now.strain, 1e-3 * start.kinetic) << "the bodies did not meet";
    EXPECT_EQ(now.momentum, reference.momentum);
    EXPECT_EQ(now.energy(), reference.energy());
    EXPECT_EQ(now.contact_nodes, reference.contact_nodes);
  }
}

TEST(ConservationOnRanks, ObliqueCollisionOfDisks) { check_collision<2>(colliding_balls(2, 24, 4), 70); }
TEST(ConservationOnRanks, ObliqueCollisionOfBalls) { check_collision<3>(colliding_balls(3, 12, 4), 25); }
TEST(ConservationOnRanks, CollisionAcrossPeriodicBoundaries) {
  Case c = colliding_balls(2, 24, 8);
  c.domain.periodic = {true, true, false};
  for (auto& body : c.bodies) body.velocity *= -1;
  check_collision<2>(c, 120);
}
TEST(ConservationOnRanks, StressUpdatesThatCommunicateOtherwise) {
  Case c = colliding_balls(2, 24, 4);
  for (StressUpdate update : {StressUpdate::first, StressUpdate::modified_last}) {
    c.solver.stress_update = update;
    check_collision<2>(c, 70);
  }
}

}  // namespace
}  // namespace cairn
