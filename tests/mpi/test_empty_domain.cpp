// Domains that are nearly empty: work follows the points, and results are those of a small domain, on any number of
// ranks, while points enter patches that nobody had before.

#include <gtest/gtest.h>
#include <mpi.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "../support/cases.hpp"

namespace cairn {
namespace {

using namespace test;

/// Two balls that meet and fly on through several patches a side, in a domain of `cells` cells a side: up and right of
/// them it may be as empty as one likes.
template <int Dim>
Case flying_balls(int cells) {
  Case c = colliding_balls(Dim, cells, 4);
  const double length = cells / 16.0;  // cells of the same size, to the last bit
  c.domain.upper = Dim == 2 ? Vec3(length, length, 0) : Vec3(length, length, length);
  c.bodies[0].velocity = Vec3(3, 2, Dim == 3 ? 1 : 0), c.bodies[1].velocity = Vec3(2, 2.5, Dim == 3 ? 1.5 : 0);
  c.parallel.balance_every = 7, c.parallel.imbalance = 1;
  return c;
}

template <int Dim>
struct Flight {
  std::map<std::int64_t, SolverPoint<Dim>> points;  // of this rank
  Totals totals;
  std::int64_t computed = 0, nodes = 0, patches = 0, entered = 0;
};

template <int Dim>
Flight<Dim> fly(const Case& c, MPI_Comm comm, int steps) {
  Simulation<Dim> simulation(c, comm);
  const PatchTable<Dim> start = simulation.table();
  Flight<Dim> flight;
  std::set<PatchId> seen;
  for (int i = 0; i < steps; ++i) {
    simulation.step(1e300);
    for (const auto& patch : simulation.patches()) {
      for (const auto& piece : patch.pieces) flight.nodes += static_cast<std::int64_t>(piece.nodes.box.size());
      if (patch.point_count() > 0) seen.insert(patch.id);
    }
  }
  flight.points = points_of(simulation), flight.totals = simulation.totals();
  flight.computed = simulation.patches_computed(), flight.patches = std::ssize(simulation.table().patches());
  flight.entered = std::ranges::count_if(seen, [&](PatchId patch) { return !start.is_filled(patch); });
  return flight;
}

template <int Dim>
void expect_same_points(const std::map<std::int64_t, SolverPoint<Dim>>& some, const Flight<Dim>& all) {
  for (const auto& [id, point] : some) {
    const auto& other = all.points.at(id);
    EXPECT_EQ(point.x, other.x);
    EXPECT_EQ(point.v, other.v);
    EXPECT_TRUE(std::ranges::equal(point.F.c, other.F.c)) << id;
    EXPECT_TRUE(std::ranges::equal(point.stress.c, other.stress.c)) << id;
  }
}

template <int Dim>
void check_empty_domain(int small, int large, int steps) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  const auto alone = fly<Dim>(flying_balls<Dim>(small), MPI_COMM_SELF, steps);
  const auto empty = fly<Dim>(flying_balls<Dim>(large), MPI_COMM_SELF, steps);
  expect_same_points(empty.points, alone);
  EXPECT_EQ(empty.points.size(), alone.points.size());
  EXPECT_EQ(empty.totals.energy(), alone.totals.energy());
  EXPECT_EQ(empty.totals.contact_dissipation, alone.totals.contact_dissipation);
  // The work and what is kept are those of the small domain, to a patch and a node.
  EXPECT_EQ(empty.computed, alone.computed);
  EXPECT_EQ(empty.nodes, alone.nodes);
  EXPECT_GT(empty.entered, 0) << "no point entered a patch that had none at the start";
  EXPECT_LT(empty.patches, 40 * std::pow(3, Dim));

  const auto shared = fly<Dim>(flying_balls<Dim>(large), MPI_COMM_WORLD, steps);
  expect_same_points(shared.points, alone);
  std::int64_t count = std::ssize(shared.points);
  MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD);
  EXPECT_EQ(count, std::ssize(alone.points));
  if (rank == 0) {
    EXPECT_EQ(shared.totals.energy(), alone.totals.energy());
    EXPECT_EQ(shared.totals.contact_dissipation, alone.totals.contact_dissipation);
    EXPECT_EQ(shared.totals.contact_nodes, alone.totals.contact_nodes);
  }
}
TEST(EmptyDomain, WorkAndResultsAreThoseOfASmallOne2D) { check_empty_domain<2>(80, 1 << 19, 400); }
TEST(EmptyDomain, WorkAndResultsAreThoseOfASmallOne3D) { check_empty_domain<3>(48, 1 << 19, 150); }

}  // namespace
}  // namespace cairn
