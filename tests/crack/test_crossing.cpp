// Exact crossings with one tie rule: no node lies on a crack, and a line through a crack point crosses one of its
// segments.

#include <gtest/gtest.h>

#include <cmath>

#include "../support/random.hpp"
#include "cairn/crack/crossing.hpp"

namespace cairn {
namespace {

using namespace crack;
using V = Vec<2>;

TEST(Crossing, SignsAndMisses) {
  const V a(0, 0), b(1, 0);  // above is y > 0
  EXPECT_EQ(crossing(V(0.5, 1), V(0.5, -1), a, b), 1);
  EXPECT_EQ(crossing(V(0.5, -1), V(0.5, 1), a, b), -1);
  EXPECT_EQ(crossing(V(0.5, 1), V(0.4, 0.1), a, b), 0);
  EXPECT_EQ(crossing(V(1.5, 1), V(1.5, -1), a, b), 0);
  EXPECT_EQ(crossing(V(0.5, 1), V(3, -1), a, b), 0) << "passes the tip";
}

TEST(Crossing, OrientationIsExactWhereRoundingIsNot) {
  // c lies off the line by one unit in the last place.
  const V a(0.1, 0.1), b(0.3, 0.3);
  const V on(0.2, 0.2), above(0.2, std::nextafter(0.2, 1)), below(0.2, std::nextafter(0.2, 0));
  EXPECT_EQ(orientation(a, b, above), 1);
  EXPECT_EQ(orientation(a, b, below), -1);
  EXPECT_EQ(orientation(a, b, on), 0);
  EXPECT_EQ(orientation(b, a, above), -1);
}

TEST(Crossing, ALineThroughACrackPointCrossesOneOfItsSegments) {
  const V a(-1, 0), vertex(0, 0), b(1, 0);
  for (const V& p : {V(0, 1), V(0.25, 1), V(-0.5, 2)}) {
    const V node = -p;  // the line goes exactly through the vertex
    EXPECT_EQ(crossing(p, node, a, vertex) + crossing(p, node, vertex, b), 1);
    EXPECT_EQ(crossing(node, p, a, vertex) + crossing(node, p, vertex, b), -1);
  }
}

TEST(Crossing, NodesOnACrackLieOnOneOfItsSides) {
  const V a(0, 0), b(2, 0), node(1, 0);
  EXPECT_EQ(std::abs(crossing(V(1, 1), node, a, b)) + std::abs(crossing(V(1, -1), node, a, b)), 1);
  const V first(0, 0), middle(1, 0);  // the node is where two segments meet
  for (const double y : {1.0, -1.0}) {
    const int both = crossing(V(0.3, y), node, first, middle) + crossing(V(0.3, y), node, middle, V(2, 0));
    EXPECT_EQ(both, crossing(V(0.3, y), node, a, b));
  }
}

/// Whatever the ties, points of a grid on one side of a closed polygon agree on which nodes lie inside.
TEST(Crossing, AnyLineIntoAClosedLineCrossesItOnce) {
  const V corners[] = {V(-2, -1), V(1, -1), V(1, 0), V(2, 2), V(-1, 1), V(-2, -1)};
  for (int x = -8; x <= 8; ++x)
    for (int y = -8; y <= 8; ++y)
      for (int i = -3; i <= 3; ++i)
        for (int j = -3; j <= 3; ++j) {
          const V node(i, j), far(x + 20.0, y), far_too(x, y + 20.0);
          const auto count = [&](const V& from) {
            int sum = 0;
            for (int k = 0; k < 5; ++k) sum += crossing(from, node, corners[k], corners[k + 1]);
            return sum;
          };
          EXPECT_EQ(count(far), count(far_too)) << i << " " << j << " from " << x << " " << y;
        }
}

}  // namespace
}  // namespace cairn
