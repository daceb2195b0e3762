// Which bodies are in parts, whatever patches and ranks they lie on.

#include <gtest/gtest.h>

#include "../../src/solver/body_parts.hpp"
#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"

namespace cairn {
namespace {

using namespace test;

/// 20 cells of .05 in each direction: two bars along x whose ends are `gap` away from each other, as one body, and a
/// ball.
Case bar_with_gap(int dimension, double gap) {
  Case c = soft_case(dimension, 20, 4);
  c.domain.periodic = {true, true, false};
  const double z = dimension == 3 ? 1 : 0;
  const Shape left = BoxShape{Vec3(0.1, 0.1, 0.1 * z), Vec3(0.5, 0.3, 0.3 * z)};
  const Shape right = BoxShape{Vec3(0.5 + gap, 0.1, 0.1 * z), Vec3(0.9, 0.3, 0.3 * z)};
  add_body(c, Compound{CompoundOperation::union_of, {left, right}});
  add_body(c, Ball{Vec3(0.6, 0.7, 0.5 * z), 0.2});
  return c;
}

/// A ball across an edge of the periodic domain, and one body of two balls far from each other.
Case across_an_edge(int dimension) {
  Case c = soft_case(dimension, 20, 4);
  c.domain.periodic = {true, true, dimension == 3};
  const double z = dimension == 3 ? 1 : 0;
  add_body(c, Ball{Vec3(0.02, 0.03, 0.98 * z), 0.15});
  add_body(c, Compound{CompoundOperation::union_of,
                       {Ball{Vec3(0.4, 0.4, 0.5 * z), 0.1}, Ball{Vec3(0.75, 0.75, 0.5 * z), 0.1}}});
  return c;
}

template <int Dim>
std::map<std::int64_t, int> parts_of(const Case& c) {
  std::map<std::int64_t, int> parts = bodies_in_parts(Simulation<Dim>(c, MPI_COMM_WORLD));
  int number = parts.empty() ? 0 : parts.begin()->second;  // what rank 0 has, for all to compare
  std::int64_t body = parts.empty() ? -1 : parts.begin()->first;
  auto count = static_cast<int>(parts.size());
  MPI_Bcast(&number, 1, MPI_INT, 0, MPI_COMM_WORLD);
  MPI_Bcast(&body, 1, MPI_INT64_T, 0, MPI_COMM_WORLD);
  MPI_Bcast(&count, 1, MPI_INT, 0, MPI_COMM_WORLD);
  EXPECT_LE(count, 1);
  if (count == 0) return {};
  return {{body, number}};
}

using Parts = std::map<std::int64_t, int>;

TEST(BodyParts, HangTogetherWhereANodeSeesBothSides) {
  for (const double cells : {0.5, 1.5}) {
    EXPECT_EQ(parts_of<2>(bar_with_gap(2, 0.05 * cells)), Parts{}) << cells;
    EXPECT_EQ(parts_of<3>(bar_with_gap(3, 0.05 * cells)), Parts{}) << cells;
  }
  EXPECT_EQ(parts_of<2>(bar_with_gap(2, 0.05 * 3.5)), (Parts{{0, 2}}));
  EXPECT_EQ(parts_of<3>(bar_with_gap(3, 0.05 * 3.5)), (Parts{{0, 2}}));
}

TEST(BodyParts, AcrossPeriodicFacesAreOne) {
  EXPECT_EQ(parts_of<2>(across_an_edge(2)), (Parts{{1, 2}}));
  EXPECT_EQ(parts_of<3>(across_an_edge(3)), (Parts{{1, 2}}));
}

}  // namespace
}  // namespace cairn
