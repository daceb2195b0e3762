#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cairn/body/shape.hpp"

namespace cairn {
namespace {

constexpr double pi = std::numbers::pi;

/// Area (dim 2) or volume of a shape by counting the midpoints of n cells along each direction of [-2, 2].
double counted(const Shape& shape, int dim, int n) {
  const double h = 4.0 / n;
  long count = 0;
  for (int k = 0; k < (dim == 3 ? n : 1); ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const double z = dim == 3 ? -2 + (k + 0.5) * h : 0.0;
        count += contains(shape, Vec3(-2 + (i + 0.5) * h, -2 + (j + 0.5) * h, z));
      }
    }
  }
  return static_cast<double>(count) * std::pow(h, dim);
}

/// The counted points all lie in the bounds, and the bounds are reached to within one cell of the counting.
void expect_tight(const Shape& shape, int n = 400) {
  const Bounds b = bounds(shape);
  Vec3 low(9, 9, 0), high(-9, -9, 0);
  const double h = 4.0 / n;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const Vec3 x(-2 + (i + 0.5) * h, -2 + (j + 0.5) * h, 0);
      if (!contains(shape, x)) continue;
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
  }
  for (int k = 0; k < 2; ++k) {
    EXPECT_LE(b.lower[k], low[k]);
    EXPECT_GE(b.upper[k], high[k]);
    EXPECT_NEAR(b.lower[k], low[k], 3 * h);
    EXPECT_NEAR(b.upper[k], high[k], 3 * h);
  }
}

Polygon regular(int n, double radius, bool clockwise) {
  Polygon p;
  for (int i = 0; i < n; ++i) {
    const double t = (clockwise ? -1 : 1) * 2 * pi * i / n + 0.1;
    p.points.emplace_back(radius * std::cos(t), radius * std::sin(t), 0);
  }
  return p;
}

TEST(Shape, AreasMatchClosedForms) {
  EXPECT_NEAR(counted(Ball{{0.1, 0.2, 0}, 1.3}, 2, 1000), pi * 1.69, 2e-3);
  EXPECT_NEAR(counted(BoxShape{{-1, -0.5, 0}, {1, 0.5, 0}, 0.4}, 2, 1000), 2.0, 4e-3);
  EXPECT_NEAR(counted(Ellipsoid{{0, 0, 0}, {1.5, 0.6, 0}, 0.7}, 2, 1000), pi * 0.9, 2e-3);
  EXPECT_NEAR(counted(regular(7, 1.2, false), 2, 1000), 3.5 * 1.44 * std::sin(2 * pi / 7), 4e-3);
  EXPECT_NEAR(counted(regular(7, 1.2, true), 2, 1000), 3.5 * 1.44 * std::sin(2 * pi / 7), 4e-3);
}

TEST(Shape, VolumesMatchClosedForms) {
  EXPECT_NEAR(counted(Ball{{0, 0, 0.1}, 1.3}, 3, 160), 4.0 / 3 * pi * std::pow(1.3, 3), 0.02);
  EXPECT_NEAR(counted(BoxShape{{-1, -0.5, -0.7}, {1, 0.5, 0.7}, 0.4}, 3, 160), 2.8, 0.03);
  EXPECT_NEAR(counted(Ellipsoid{{0, 0, 0}, {1.5, 0.6, 0.9}, 0.7}, 3, 160), 4.0 / 3 * pi * 0.81, 0.02);
  EXPECT_NEAR(counted(Cylinder{{-0.5, -0.4, -0.3}, {0.7, 0.8, 0.9}, 0.6}, 3, 160), pi * 0.36 * 1.2 * std::sqrt(3.0),
              0.02);
}

TEST(Shape, BoundaryCountsAsInside) {
  const double s = std::sqrt(0.5);
  EXPECT_TRUE(contains(Ball{{0, 0, 0}, 1}, {s, s, 0}));
  EXPECT_TRUE(contains(BoxShape{{0, 0, 0}, {1, 2, 0}}, {1, 2, 0}));
  EXPECT_TRUE(contains(BoxShape{{-1, -1, 0}, {1, 1, 0}, pi / 4}, {std::sqrt(2.0), 0, 0}));
  EXPECT_FALSE(contains(BoxShape{{-1, -1, 0}, {1, 1, 0}, pi / 4}, {std::sqrt(2.0) * (1 + 1e-9), 0, 0}));
  EXPECT_TRUE(contains(Ellipsoid{{0, 0, 0}, {2, 1, 0}, pi / 2}, {0, 2, 0}));
  EXPECT_TRUE(contains(Cylinder{{0, 0, 0}, {0, 0, 1}, 1}, {s, s, 1}));
  EXPECT_TRUE(contains(HalfSpace{{0, 1, 0}, {1, 1, 0}}, {0.3, 0.7, 0}));
  const Polygon hexagon = regular(6, 1, false);
  for (std::size_t i = 0; i < 6; ++i) {
    const Vec3 a = hexagon.points[i], b = hexagon.points[(i + 1) % 6];
    for (double t : {0.0, 0.1, 0.5, 1.0 / 3, 1.0}) {
      const Vec3 x = a + t * (b - a);
      EXPECT_TRUE(contains(hexagon, x)) << i << " " << t;
      EXPECT_FALSE(contains(hexagon, 1.000001 * x)) << i << " " << t;
    }
  }
}

TEST(Shape, PolygonWithReentrantCornersAndVerticesOnTheRay) {
  // A comb whose vertices lie at the height of the tested points.
  const Polygon comb{{{0, 0, 0}, {4, 0, 0}, {4, 2, 0}, {3, 1, 0}, {2, 2, 0}, {1, 1, 0}, {0, 2, 0}}};
  EXPECT_TRUE(contains(comb, {0.5, 1, 0}));
  EXPECT_TRUE(contains(comb, {2, 1, 0}));
  EXPECT_TRUE(contains(comb, {1, 1, 0}));
  EXPECT_FALSE(contains(comb, {-0.5, 1, 0}));
  EXPECT_FALSE(contains(comb, {4.5, 1, 0}));
  EXPECT_FALSE(contains(comb, {1, 1.5, 0}));
  EXPECT_FALSE(contains(comb, {-1, 0, 0}));
  EXPECT_FALSE(contains(comb, {-1, 2, 0}));
  EXPECT_FALSE(contains(comb, {5, 2, 0}));
  EXPECT_TRUE(contains(comb, {2.0, 1.9999, 0}));
}

TEST(Shape, BoundsAreTight) {
  expect_tight(Ball{{0.2, -0.1, 0}, 0.9});
  expect_tight(BoxShape{{-1, -0.3, 0}, {0.8, 0.5, 0}, 2.2});
  expect_tight(Ellipsoid{{0.1, 0, 0}, {1.3, 0.4, 0}, -0.6});
  expect_tight(regular(5, 1.1, true));
  const Bounds b = bounds(Cylinder{{0, 0, 0}, {3, 4, 0}, 1});
  EXPECT_TRUE(b.lower.isApprox(Vec3(-0.8, -0.6, -1), 1e-14));
  EXPECT_TRUE(b.upper.isApprox(Vec3(3.8, 4.6, 1), 1e-14));
}

TEST(Shape, CompoundsFollowSetAlgebra) {
  const Shape big = Ball{{0, 0, 0}, 1}, hole = Ball{{0, 0, 0}, 0.5}, right = HalfSpace{{0, 0, 0}, {-1, 0, 0}};
  EXPECT_NEAR(counted(Compound{CompoundOperation::difference, {big, hole}}, 2, 1000), pi * 0.75, 4e-3);
  EXPECT_NEAR(counted(Compound{CompoundOperation::intersection, {big, right}}, 2, 1000), pi / 2, 4e-3);
  EXPECT_NEAR(counted(Compound{CompoundOperation::union_of, {hole, Ball{{1.2, 0, 0}, 0.5}}}, 2, 1000), pi / 2, 4e-3);
  const Shape nested =
      Compound{CompoundOperation::intersection, {Compound{CompoundOperation::difference, {big, hole}}, right}};
  EXPECT_NEAR(counted(nested, 2, 1000), pi * 0.375, 4e-3);
  EXPECT_FALSE(contains(Compound{CompoundOperation::intersection, {}}, {0, 0, 0}));
  expect_tight(Compound{CompoundOperation::union_of, {hole, Ball{{1.2, 0, 0}, 0.5}}});
}

TEST(Shape, HalfSpaceBoundsAreCutByIntersections) {
  const double inf = std::numeric_limits<double>::infinity();
  const Bounds free = bounds(HalfSpace{{0, 0.5, 0}, {1, 1, 0}});
  EXPECT_EQ(free.lower, Vec3::Constant(-inf));
  EXPECT_EQ(free.upper, Vec3::Constant(inf));
  const Bounds floor = bounds(HalfSpace{{0, 0.5, 0}, {0, 2, 0}});
  EXPECT_EQ(floor.upper.y(), 0.5);
  EXPECT_EQ(floor.lower.y(), -inf);
  const Shape square = BoxShape{{0, 0, 0}, {1, 1, 0}};
  expect_tight(Compound{CompoundOperation::intersection, {square, HalfSpace{{0.5, 0, 0}, {1, 1, 0}}}});
  expect_tight(Compound{CompoundOperation::difference, {square, HalfSpace{{0, 0.75, 0}, {-1, -2, 0}}}});
  // A wedge bounded only by planes.
  expect_tight(
      Compound{CompoundOperation::intersection,
               {HalfSpace{{1, 0, 0}, {1, 1, 0}}, HalfSpace{{0, 0, 0}, {-1, 0, 0}}, HalfSpace{{0, 0, 0}, {0, -1, 0}}}});
}

TEST(Shape, CentreIsThatOfTheBody) {
  EXPECT_EQ(centre(Ball{{1, 2, 3}, 1}), Vec3(1, 2, 3));
  EXPECT_EQ(centre(Ellipsoid{{1, 2, 0}, {1, 2, 0}, 0.3}), Vec3(1, 2, 0));
  EXPECT_TRUE(centre(BoxShape{{0, 0, 0}, {2, 1, 0}, 0.3}).isApprox(Vec3(1, 0.5, 0), 1e-14));
  EXPECT_TRUE(centre(Polygon{{{0, 0, 0}, {2, 0, 0}, {2, 4, 0}}}).isApprox(Vec3(1, 2, 0), 1e-14));
  const Shape slab =
      Compound{CompoundOperation::intersection, {HalfSpace{{0, 1, 0}, {0, 1, 0}}, HalfSpace{{0, 0.5, 0}, {0, -1, 0}}}};
  EXPECT_TRUE(centre(slab).isApprox(Vec3(0, 0.75, 0), 1e-14));
}

TEST(Shape, ShiftedItHoldsWhatItHeldFurtherOn) {
  const Vec3 way(0.3, -0.2, 0);
  const Shape half = HalfSpace{{0.1, 0.2, 0}, {1, 2, 0}};
  const Shape disk = Ball{{0.1, 0.2, 0}, 1};
  for (const Shape& shape :
       {disk, half, Shape(BoxShape{{-1, -0.5, 0}, {1, 0.5, 0}, 0.4}), Shape(Ellipsoid{{0.1, 0, 0}, {1, 0.5, 0}, 0.3}),
        Shape(regular(5, 1, false)), Shape(Cylinder{{-1, 0, 0}, {1, 0.3, 0}, 0.4}),
        Shape(Compound{CompoundOperation::intersection, {disk, half}})}) {
    const Shape further = shifted(shape, way);
    EXPECT_LT((centre(further) - centre(shape) - way).norm(), std::holds_alternative<HalfSpace>(shape) ? 1 : 1e-14);
    EXPECT_TRUE(bounds(further).lower.x() == -shapes::infinity ||
                std::abs(bounds(further).lower.x() - bounds(shape).lower.x() - way.x()) < 1e-14);
    for (int i = 0; i < 40; ++i)
      for (int j = 0; j < 40; ++j) {
        const Vec3 x(-2.003 + 0.1 * i, -2.001 + 0.1 * j, 0);
        EXPECT_EQ(contains(further, x + way), contains(shape, x)) << shape.index() << " at " << x.transpose();
      }
  }
}

TEST(Shape, SmallestWidth) {
  EXPECT_EQ(smallest_width(Ball{{1, 2, 3}, 1.5}), 3);
  EXPECT_EQ(smallest_width(BoxShape{{0, 0, 0}, {2, 1, 0}, 0.3}), 1);
  EXPECT_EQ(smallest_width(Ellipsoid{{0, 0, 0}, {2, 1, 0}, 0.3}), 2);
  EXPECT_EQ(smallest_width(Cylinder{{0, 0, 0}, {0, 3, 0}, 1}), 2);
  EXPECT_TRUE(std::isinf(smallest_width(HalfSpace{{0, 0, 0}, {1, 0, 0}})));
  // A right triangle with legs 3 and 4: its height above the hypotenuse.
  EXPECT_NEAR(smallest_width(Polygon{{{0, 0, 0}, {4, 0, 0}, {0, 3, 0}}}), 2.4, 1e-14);
  EXPECT_EQ(smallest_width(Compound{CompoundOperation::union_of, {Ball{{0, 0, 0}, 1}, Ball{{2, 0, 0}, 0.5}}}), 1);
  const Shape slab =
      Compound{CompoundOperation::intersection, {Ball{{0, 0, 0}, 1}, BoxShape{{-1, 0, -1}, {1, 0.2, 1}}}};
  EXPECT_NEAR(smallest_width(slab), 0.2, 1e-14);
}

}  // namespace
}  // namespace cairn
