#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "cairn/body/shape.hpp"

namespace cairn {
namespace {

constexpr double pi = std::numbers::pi;

/// A sphere of 20 * 4^n triangles.
Triangles sphere(int n, double radius = 1, const Vec3& centre = Vec3::Zero()) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  Triangles t;
  t.points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
              {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  t.corners = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
               {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
               {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < n; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [entry, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<int>(t.points.size()));
      if (fresh) t.points.push_back((t.points[a].normalized() + t.points[b].normalized()).normalized());
      return entry->second;
    };
    std::vector<std::array<std::int32_t, 3>> finer;
    for (const auto& c : t.corners) {
      const int a = middle(c[0], c[1]), b = middle(c[1], c[2]), d = middle(c[2], c[0]);
      finer.insert(finer.end(), {{c[0], a, d}, {c[1], b, a}, {c[2], d, b}, {a, b, d}});
    }
    t.corners = std::move(finer);
  }
  for (Vec3& p : t.points) p = centre + radius * p.normalized();
  return t;
}

Triangles box(const Vec3& low, const Vec3& high) {
  Triangles t;
  for (int c = 0; c < 8; ++c)
    t.points.emplace_back((c & 1 ? high : low).x(), (c & 2 ? high : low).y(), (c & 4 ? high : low).z());
  t.corners = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
               {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return t;
}

Triangles joined(Triangles a, const Triangles& b) {
  const auto first = static_cast<std::int32_t>(a.points.size());
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (const auto& c : b.corners) a.corners.push_back({first + c[0], first + c[1], first + c[2]});
  return a;
}

/// Places of [-1.2, 1.2]^3 where the solid and what is right differ; those nearer to it than `slack` do not count.
template <class Right>
int differences(const Solid& solid, Right&& right, int count = 20000) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.2, 1.2);
  int wrong = 0;
  for (int i = 0; i < count; ++i) {
    const Vec3 x(any(random), any(random), any(random));
    const int found = right(x);
    wrong += found >= 0 && found != int(solid.holds(x));
  }
  return wrong;
}

TEST(Solid, ASphereOfTrianglesHoldsWhatTheSphereHolds) {
  Triangles t = sphere(5);
  EXPECT_EQ(t.corners.size(), 20480U);
  const SurfaceFaults faults = mend(t);
  EXPECT_EQ(faults.open_edges + faults.flipped + faults.repeated + faults.crossings + faults.shared_edges, 0);
  EXPECT_FALSE(faults.inside_out);
  const Solid solid(t, true);
  EXPECT_NEAR(solid.volume(), 4 * pi / 3, 0.003 * 4 * pi / 3);
  EXPECT_LT(solid.centroid().norm(), 1e-12);
  EXPECT_NEAR(solid.thickness(), 2, 0.01);
  EXPECT_EQ(differences(solid, [](const Vec3& x) { return std::abs(x.norm() - 1) < 1e-3 ? -1 : int(x.norm() < 1); }),
            0);
}

TEST(Solid, NoLineSlipsThroughEdgesAndCorners) {
  // Places on lines and planes through the edges and corners of few large triangles.
  Triangles t = box({-1, -1, -1}, {1, 1, 1});
  mend(t);
  const Solid solid(t, true);
  EXPECT_NEAR(solid.volume(), 8, 1e-14);
  for (int k = -5; k <= 5; ++k)
    for (int j = -5; j <= 5; ++j)
      for (int i = -5; i <= 5; ++i) {
        const Vec3 x = Vec3(i, j, k) * 0.24;
        EXPECT_EQ(solid.holds(x), x.cwiseAbs().maxCoeff() < 1) << x.transpose();
      }
}

TEST(Solid, HoldsWhereTheWindingNumberIsOne) {
  Triangles t = joined(sphere(3, 0.5, {-0.3, 0, 0}), sphere(2, 0.6, {0.4, 0.1, 0.1}));  // two that overlap
  const SurfaceFaults faults = mend(t);
  EXPECT_GT(faults.crossings, 10);
  const Solid solid(t, true);
  EXPECT_EQ(differences(solid,
                        [&](const Vec3& x) {
                          const double w = solid.winding(x), off = std::abs(w - std::round(w));
                          return off > 0.1 ? -1 : int(w > 0.5);
                        }),
            0);
}

TEST(Solid, TurnedAndRepeatedTrianglesAreMended) {
  Triangles t = sphere(3);
  for (std::size_t i = 0; i < t.corners.size(); i += 7) std::swap(t.corners[i][0], t.corners[i][1]);
  const auto turned = static_cast<std::int64_t>((t.corners.size() + 6) / 7);
  t.corners.push_back(t.corners[5]), t.corners.push_back({3, 3, 4});
  const SurfaceFaults faults = mend(t);
  EXPECT_EQ(faults.flipped, turned);
  EXPECT_EQ(faults.repeated, 1);
  EXPECT_EQ(faults.flat, 1);
  EXPECT_EQ(faults.open_edges, 0);
  const Solid solid(t, true);
  EXPECT_EQ(differences(solid, [](const Vec3& x) { return std::abs(x.norm() - 1) < 0.02 ? -1 : int(x.norm() < 1); }),
            0);
}

TEST(Solid, WhatIsInsideOutIsTurnedAndACavityIsNot) {
  Triangles inner = sphere(2, 0.5);
  for (auto& c : inner.corners) std::swap(c[0], c[1]);
  Triangles alone = inner, hollow = joined(sphere(3), inner);
  EXPECT_TRUE(mend(alone).inside_out);
  EXPECT_GT(Solid(alone, true).volume(), 0);
  EXPECT_FALSE(mend(hollow).inside_out);
  const Solid solid(hollow, true);
  EXPECT_FALSE(solid.holds(Vec3(0.01, 0.02, 0)));
  EXPECT_TRUE(solid.holds(Vec3(0.75, 0.02, 0)));
  EXPECT_NEAR(solid.thickness(), 0.5, 0.03);
}

TEST(Solid, AHoleIsFoundAndClosedWhereItIsSmall) {
  Triangles t = sphere(4);
  const Vec3 where = (t.points[t.corners[100][0]] + t.points[t.corners[100][1]] + t.points[t.corners[100][2]]) / 3;
  t.corners.erase(t.corners.begin() + 100);
  const SurfaceFaults faults = mend(t);
  EXPECT_EQ(faults.open_edges, 3);
  EXPECT_LT((faults.open_at - where).norm(), 0.1);
  EXPECT_GT(faults.largest_hole, 0.05);
  EXPECT_LT(faults.largest_hole, 0.2);
  const Solid solid(t, false);
  EXPECT_EQ(differences(
                solid, [](const Vec3& x) { return std::abs(x.norm() - 1) < 0.05 ? -1 : int(x.norm() < 1); }, 3000),
            0);
}

TEST(Solid, APlacedMeshIsScaledTurnedAndMoved) {
  Triangles t = box({0, 0, 0}, {2, 1, 1});
  mend(t);
  Mesh mesh;
  mesh.placement = {"mm", 10, {1, 2, 3}, {0, 0, pi / 2}};
  mesh.inside = std::make_shared<Solid>(t, true);
  mesh.place = Place(mesh.placement);
  mesh.box = mesh.place.in_space(mesh.inside->bounds());
  const Shape shape = mesh;
  EXPECT_NEAR(known_volume(shape), 2e-6, 1e-18);
  EXPECT_NEAR(smallest_width(shape), 0.01, 1e-12);
  EXPECT_LT((centre(shape) - Vec3(0.995, 2.01, 3.005)).norm(), 1e-12);
  EXPECT_TRUE(contains(shape, {0.995, 2.015, 3.005}));
  EXPECT_FALSE(contains(shape, {1.005, 2.015, 3.005}));
  EXPECT_LT((bounds(shape).lower - Vec3(0.99, 2, 3)).norm(), 1e-12);
  const Shape further = shifted(shape, {5, 0, 1});
  EXPECT_LT((centre(further) - Vec3(5.995, 2.01, 4.005)).norm(), 1e-12);
  EXPECT_TRUE(contains(further, {5.995, 2.015, 4.005}));
  EXPECT_FALSE(contains(further, {0.995, 2.015, 3.005}));
  EXPECT_LT((bounds(further).lower - Vec3(5.99, 2, 4)).norm(), 1e-12);
}

TEST(Loops, HolesCountWhicheverWayTheyRun) {
  const std::vector<Vec3> outer = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}},
                          hole = {{1, 1, 0}, {3, 1, 0}, {3, 3, 0}, {1, 3, 0}};
  std::vector<Vec3> other(hole.rbegin(), hole.rend());
  for (const auto& inner : {hole, other}) {
    const Loops loops({outer, inner});
    EXPECT_NEAR(loops.area(), 12, 1e-12);
    EXPECT_LT((loops.centroid() - Vec3(2, 2, 0)).norm(), 1e-12);
    EXPECT_NEAR(loops.thickness(), 1, 1e-12);
    EXPECT_TRUE(loops.holds({0.5, 2, 0}));
    EXPECT_FALSE(loops.holds({2, 2, 0}));
    EXPECT_FALSE(loops.holds({4.5, 2, 0}));
  }
}

}  // namespace
}  // namespace cairn
