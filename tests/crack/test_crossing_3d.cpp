// Exact crossings of triangles with one tie rule: no node lies on a crack, and a line through an edge or a corner of a
// surface crosses one of the triangles there.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "cairn/crack/crossing.hpp"

namespace cairn {
namespace {

using namespace crack;
using V = Vec<3>;
using Corners = std::array<V, 3>;

TEST(Crossing3D, SignsAndMisses) {
  const Corners t = {V(0, 0, 0), V(1, 0, 0), V(0, 1, 0)};  // above is z > 0
  EXPECT_EQ(crossing(V(0.3, 0.3, 1), V(0.3, 0.3, -1), t), 1);
  EXPECT_EQ(crossing(V(0.3, 0.3, -1), V(0.3, 0.3, 1), t), -1);
  EXPECT_EQ(crossing(V(0.3, 0.3, 1), V(0.3, 0.3, 0.1), t), 0);
  EXPECT_EQ(crossing(V(0.6, 0.6, 1), V(0.6, 0.6, -1), t), 0) << "passes the rim";
  EXPECT_EQ(crossing(V(0.3, 0.3, 1), V(3, 3, -1), t), 0);
}

TEST(Crossing3D, OrientationIsExactWhereRoundingIsNot) {
  const V a(0.1, 0.1, 0.1), b(0.7, 0.3, 0.3), c(0.3, 0.9, 0.9);  // in the plane y = z
  for (const double x : {0.2, 0.35, 0.5}) {
    const double y = 0.4;
    EXPECT_EQ(orientation(a, b, c, V(x, y, y)), 0);
    EXPECT_EQ(orientation(a, b, c, V(x, y, std::nextafter(y, 1))), 1);
    EXPECT_EQ(orientation(a, b, c, V(x, y, std::nextafter(y, 0))), -1);
    EXPECT_EQ(orientation(b, a, c, V(x, y, std::nextafter(y, 1))), -1);
  }
}

TEST(Crossing3D, AnEdgeHasOneSideWhicheverWayItRuns) {
  for (int k = 0; k < 3; ++k) {
    const V p(0, 0, 1), i(0, 0, -1), a = V::Zero(), b = V::Unit(k);  // through a; along the line itself for k = 2
    EXPECT_NE(side_of_line(p, i, a, b), 0);
    EXPECT_EQ(side_of_line(p, i, a, b), -side_of_line(p, i, b, a));
  }
}

/// A fan around a corner, in a plane or not, and lines through the corner, its edges and along them.
TEST(Crossing3D, ALineThroughACornerOrAnEdgeCrossesOneTriangle) {
  for (const double height : {0.0, 0.25}) {
    std::vector<Corners> fan;
    const V middle(0, 0, height);
    const int n = 8;
    const auto rim = [](int k) {
      return V(k % 8 == 0 || k % 8 == 1 || k % 8 == 7 ? 1
               : k % 8 == 2 || k % 8 == 6             ? 0
                                                      : -1,
               k % 8 >= 1 && k % 8 <= 3   ? 1
               : k % 8 == 0 || k % 8 == 4 ? 0
                                          : -1,
               0);
    };
    for (int k = 0; k < n; ++k) fan.push_back({middle, rim(k), rim(k + 1)});
    for (const double x : {0.0, 0.25, -0.5, 0.5})
      for (const double y : {0.0, 0.25, -0.25, 0.5}) {
        const V p(x, y, 2), i(-x, -y, -2 + 2 * height);  // some of them through the corner
        int sum = 0, count = 0;
        for (const Corners& t : fan) sum += crossing(p, i, t), count += std::abs(crossing(p, i, t));
        EXPECT_EQ(sum, 1) << x << " " << y;
        EXPECT_EQ(count % 2, 1);
        int back = 0;
        for (const Corners& t : fan) back += crossing(i, p, t);
        EXPECT_EQ(back, -1);
      }
  }
}

/// Whatever the ties, lines into a closed surface agree on which nodes lie inside.
TEST(Crossing3D, AnyLineIntoAClosedSurfaceCrossesItOnce) {
  std::vector<Corners> cube;  // corners at 0 and 2, outward normals
  const auto add = [&](const V& o, const V& u, const V& v) {
    cube.push_back({o, o + u, o + u + v}), cube.push_back({o, o + u + v, o + v});
  };
  const V x = 2 * V::UnitX(), y = 2 * V::UnitY(), z = 2 * V::UnitZ(), o = V::Zero();
  add(o, y, x), add(z, x, y), add(o, x, z), add(y, z, x), add(o, z, y), add(x, y, z);
  int inside = 0;
  for (int i = -1; i <= 3; ++i)
    for (int j = -1; j <= 3; ++j)
      for (int k = -1; k <= 3; ++k) {
        const V node(i, j, k);
        const auto count = [&](const V& from) {
          int sum = 0;
          for (const Corners& t : cube) sum += crossing(from, node, t);
          return sum;
        };
        const int first = count(V(i, j, 9));
        for (const V& from : {V(9, j, k), V(i, -9, k), V(i + 9, j + 9, k), V(i + 9, j + 9, k + 9), V(-7, 8, 9)})
          EXPECT_EQ(count(from), first) << node.transpose() << " from " << from.transpose();
        inside += first;
      }
  EXPECT_EQ(inside, 8) << "nodes at 0 lie inside as they are thought moved, those at 2 outside";
}

}  // namespace
}  // namespace cairn
