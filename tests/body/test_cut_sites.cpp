// Points at the surfaces of round bodies: their volumes and first moments against closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cairn/body/cut_sites.hpp"

namespace cairn {
namespace {

constexpr double pi = std::numbers::pi;
const Vec3 origin(-2.03, -2.01, -1.97);

template <int Dim>
Vec3 spacing() {
  Vec3 s = Vec3::Zero();
  for (int d = 0; d < Dim; ++d) s[d] = 0.1 + 0.01 * d;
  return s;
}

template <int Dim>
struct Sums {
  double volume = 0;
  Vec3 moment = Vec3::Zero();
};

template <int Dim>
Box<Dim> all_sites() {
  Box<Dim> sites;
  sites.upper.fill(40);
  return sites;
}

/// Volume [m^Dim] and first moment of all points; checks that each lies in its site and is worth half a point or more.
template <int Dim>
Sums<Dim> sums_of(const Shape& shape) {
  const Vec3 h = spacing<Dim>();
  const CutSites<Dim> sites(shape, origin, h, all_sites<Dim>());
  double whole = 1;
  for (int d = 0; d < Dim; ++d) whole *= h[d];
  Sums<Dim> sums;
  for_each(all_sites<Dim>(), [&](const Index<Dim>& i) {
    const PointSite point = sites.at(i);
    if (point.share == 0) return;
    EXPECT_GE(point.share, 0.5);
    EXPECT_LE(point.share, 2.5);
    for (int d = 0; d < Dim; ++d) {
      EXPECT_GT(point.position[d], origin[d] + i[d] * h[d]);
      EXPECT_LT(point.position[d], origin[d] + (i[d] + 1) * h[d]);
    }
    sums.volume += point.share * whole, sums.moment += point.share * whole * point.position;
  });
  return sums;
}

template <int Dim>
void expect_sums(const Shape& shape, double volume, const Vec3& middle) {
  const auto sums = sums_of<Dim>(shape);
  EXPECT_NEAR(sums.volume / volume, 1, 1e-3);
  EXPECT_NEAR((sums.moment / sums.volume - middle).norm(), 0, 1e-3);
}

TEST(CutSites, KeepTheVolumeAndCentreOfRoundBodies) {
  const Vec3 c(0.137, -0.211, 0);
  expect_sums<2>(Ball{c, 0.83}, pi * 0.83 * 0.83, c);
  expect_sums<2>(Ellipsoid{c, {1.2, 0.5, 0}, 0.7}, pi * 1.2 * 0.5, c);
  const Shape ring = Compound{CompoundOperation::difference, {Ball{c, 1.1}, Ball{c, 0.62}}};
  expect_sums<2>(ring, pi * (1.1 * 1.1 - 0.62 * 0.62), c);
  const Vec3 c3(0.137, -0.211, 0.05);
  expect_sums<3>(Ball{c3, 0.83}, 4 / 3.0 * pi * std::pow(0.83, 3), c3);
  expect_sums<3>(Ellipsoid{c3, {1.2, 0.5, 0.8}, 0.7}, 4 / 3.0 * pi * 1.2 * 0.5 * 0.8, c3);
}

TEST(CutSites, AreWholeInsideAndSymmetric) {
  const Vec3 h = spacing<2>();
  const Vec3 node = origin + Vec3(20 * h.x(), 20 * h.y(), -origin.z());
  const CutSites<2> sites(Ball{node, 0.57}, origin, h, all_sites<2>());
  for_each(all_sites<2>(), [&](const Index<2>& i) {
    const PointSite point = sites.at(i), mirrored = sites.at({39 - i[0], i[1]});
    EXPECT_NEAR(point.share, mirrored.share, 1e-12);
    const Vec3 middle = origin + Vec3((i[0] + 0.5) * h.x(), (i[1] + 0.5) * h.y(), -origin.z());
    if ((middle - node).norm() < 0.57 - 2 * h.norm()) {
      EXPECT_EQ(point.share, 1);
      EXPECT_NEAR((point.position - middle).norm(), 0, 1e-14);
    }
  });
}

TEST(CutSites, DoNotDependOnWhichSitesAreAskedFor) {
  const Shape ball = Ball{{0.137, -0.211, 0.05}, 0.43};
  const Vec3 h = spacing<3>();
  const CutSites<3> together(ball, origin, h, all_sites<3>());
  int cut = 0;
  Box<3> part;
  part.lower = {14, 10, 13}, part.upper = {28, 25, 24};
  for_each(part, [&](const Index<3>& i) {
    Box<3> one{i, i};
    for (int& end : one.upper) ++end;
    const PointSite alone = CutSites<3>(ball, origin, h, one).at(i), point = together.at(i);
    EXPECT_EQ(alone.share, point.share);
    EXPECT_EQ(alone.position, point.position);
    cut += point.share > 0 && point.share != 1;
  });
  EXPECT_GT(cut, 100);
}

TEST(CutSites, AreForShapesWithoutFlatFaces) {
  const Shape ball = Ball{Vec3::Zero(), 1}, box = BoxShape{-Vec3::Ones(), Vec3::Ones()};
  EXPECT_TRUE(is_round(ball));
  EXPECT_TRUE(is_round(Ellipsoid{Vec3::Zero(), Vec3::Ones()}));
  EXPECT_FALSE(is_round(box));
  EXPECT_TRUE(is_round(Compound{CompoundOperation::difference, {ball, ball}}));
  EXPECT_FALSE(is_round(Compound{CompoundOperation::intersection, {ball, box}}));
}

}  // namespace
}  // namespace cairn
