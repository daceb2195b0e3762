// Surfaces of cracks: their areas, edges and rims.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>

#include "cairn/crack/triangles.hpp"

namespace cairn {
namespace {

double area_of(const Triangles& t, Vec3& normal) {
  double area = 0;
  normal.setZero();
  for (const auto& c : t.corners) {
    const Vec3 across = 0.5 * (t.points[c[1]] - t.points[c[0]]).cross(t.points[c[2]] - t.points[c[0]]);
    area += across.norm(), normal += across;
  }
  normal.normalize();
  return area;
}

double longest_edge(const Triangles& t) {
  double longest = 0;
  for (const auto& c : t.corners)
    for (int k = 0; k < 3; ++k) longest = std::max(longest, (t.points[c[k]] - t.points[c[(k + 1) % 3]]).norm());
  return longest;
}

/// Triangles that are held, and edges of the rim by kind.
std::array<int, 3> counts(const std::vector<CrackHeld<3>>& held) {
  std::array<int, 3> n{};
  for (const auto& point : held)
    for (int t = 0; t < point.held; ++t) {
      ++n[0];
      for (int k = 0; k < 3; ++k)
        if (point.triangles[t].edge(k) != CrackEdge::inner) ++n[static_cast<int>(point.triangles[t].edge(k))];
    }
  return n;
}

TEST(CrackSurface, Disk) {
  CrackSpec spec;
  spec.disk = CrackDisk{Vec3(1, 2, 3), Vec3(1, -2, 0.5), 0.6};
  const double h = 0.1;
  const Triangles t = crack_surface(spec, h);
  Vec3 normal;
  EXPECT_NEAR(area_of(t, normal), M_PI * 0.36, 0.002 * M_PI * 0.36);
  EXPECT_LE((normal - spec.disk->normal.normalized()).norm(), 1e-12);
  EXPECT_LE(longest_edge(t), 0.75 * h);  // that across a square of half a spacing
  EXPECT_EQ(problem_of_surface(t), "");
  const auto held = hold_surface(t, h, [](const Vec3& x) { return x.x() < 1; });
  const auto n = counts(held);
  EXPECT_EQ(n[0], std::ssize(t.corners));
  EXPECT_EQ(n[1] + n[2], 72);  // 6 for each ring
  EXPECT_NEAR(n[2], 36, 3);
  for (std::size_t i = 0; i < held.size(); ++i)
    if (held[i].tip) {
      EXPECT_NEAR((t.points[i] - spec.disk->centre).norm(), 0.6, 1e-12);
    }
}

TEST(CrackSurface, DrawnOutLine) {
  CrackSpec spec;
  spec.points = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1.5, 0.5, 0)}, spec.extrude = Vec3(0, 0, 0.4);
  const Triangles t = crack_surface(spec, 0.2);
  Vec3 normal;
  EXPECT_NEAR(area_of(t, normal), 0.4 * (1 + std::sqrt(0.5)), 1e-12);
  EXPECT_GT(normal.y(), 0.8) << "above is left of the line, as in 2D";
  const auto held = hold_surface(t, 0.2, [](const Vec3& x) { return x.x() < 1.2; });
  int tips = 0;
  for (const auto& point : held) {
    tips += point.tip;
    EXPECT_LE(point.held, 4);
  }
  EXPECT_GT(tips, 0);
}

/// A file's triangles are halved until they are short, without gaps.
TEST(CrackSurface, RefinedTriangles) {
  CrackSpec spec;
  spec.file.emplace();
  Triangles& coarse = spec.file->triangles;
  coarse.points = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0.2), Vec3(0, 1, 0), Vec3(2.1, 0.4, 0.1)};
  coarse.corners = {{0, 1, 2}, {0, 2, 3}, {1, 4, 2}};
  Vec3 normal;
  const double area = area_of(coarse, normal), h = 0.23;
  const Triangles t = crack_surface(spec, h);
  EXPECT_NEAR(area_of(t, normal), area, 1e-12);
  EXPECT_LE(longest_edge(t), 0.6 * h);
  std::map<std::pair<int, int>, int> directed;
  for (const auto& c : t.corners)
    for (int k = 0; k < 3; ++k) ++directed[{c[k], c[(k + 1) % 3]}];
  double rim = 0;
  for (const auto& [edge, count] : directed) {
    EXPECT_EQ(count, 1);
    if (!directed.contains({edge.second, edge.first})) rim += (t.points[edge.first] - t.points[edge.second]).norm();
  }
  const auto side = [&](int a, int b) { return (coarse.points[a] - coarse.points[b]).norm(); };
  EXPECT_NEAR(rim, side(0, 1) + side(1, 4) + side(4, 2) + side(2, 3) + side(3, 0), 1e-12);
  EXPECT_EQ(counts(hold_surface(t, h, [](const Vec3&) { return true; }))[0], std::ssize(t.corners));
}

TEST(CrackSurface, BranchesAreRefused) {
  Triangles t;
  t.points = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(0, 0, 1)};
  t.corners = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  EXPECT_NE(problem_of_surface(t).find("3 triangles share"), std::string::npos);
}

}  // namespace
}  // namespace cairn
