// Volumes of shapes in the domain, places that several images hold counted once.

#include <gtest/gtest.h>

#include <numbers>

#include "cairn/solver/volume.hpp"

namespace cairn {
namespace {

Domain unit_square(bool periodic) {
  Domain d;
  d.dimension = 2, d.upper = Vec3(1, 1, 0), d.cells = {16, 16, 1}, d.periodic = {periodic, false, false};
  return d;
}
BoxShape box(double left, double right) { return {Vec3(left, 0, 0), Vec3(right, 0.5, 0)}; }

TEST(Volume, OfWhatHasNoEndIsThatOfItsPartInTheDomain) {
  const HalfSpace half{Vec3(0, 0.5, 0), Vec3(0, 1, 0)};
  for (bool periodic : {false, true}) EXPECT_NEAR(volume_of(half, unit_square(periodic), 64), 0.5, 1e-12);
}
TEST(Volume, OfWhatMeetsItsOwnImagesCountsOnce) {
  const Compound both{CompoundOperation::union_of, {box(-0.3, 0.5), box(0.4, 1.3)}};
  EXPECT_NEAR(volume_of(both, unit_square(true), 64), 0.5, 1e-12);
  EXPECT_NEAR(volume_of(box(-2, 2.5), unit_square(true), 64), 0.5, 1e-12);
  EXPECT_NEAR(volume_of(Ball{Vec3(0.5, 0.5, 0), 2}, unit_square(true), 64), 1, 1e-12);
}
TEST(Volume, PeriodicDirectionsDoNotCut) {
  EXPECT_EQ(volume_of(box(-0.25, 0.5), unit_square(true), 64), 0.375);
  EXPECT_EQ(volume_of(box(-0.25, 0.5), unit_square(false), 64), 0.25);
  EXPECT_NEAR(volume_of(Ball{Vec3(0, 0.5, 0), 0.25}, unit_square(true), 64), std::numbers::pi / 16, 1e-12);
  EXPECT_NEAR(volume_of(Ball{Vec3(0, 0.5, 0), 0.25}, unit_square(false), 64), std::numbers::pi / 32, 1e-12);
  EXPECT_NEAR(volume_of(Ellipsoid{Vec3(0, 0.5, 0), Vec3(0.25, 0.125, 0)}, unit_square(true), 256),
              std::numbers::pi / 32, 1e-3);
}

}  // namespace
}  // namespace cairn
