// Eight doubles at a time do what one does.

#include <gtest/gtest.h>

#include <limits>

#include "../support/random.hpp"
#include "cairn/core/lanes.hpp"

namespace cairn {
namespace {

Lanes eight(test::Random& random, double lower, double upper) {
  Lanes a;
  for (int i = 0; i < lane_count; ++i) a[i] = random(lower, upper);
  return a;
}

TEST(Lanes, InverseCubeRootToRoundOff) {
  test::Random random;
  for (int k = 0; k < 20000; ++k) {
    Lanes a;
    for (int i = 0; i < lane_count; ++i) a[i] = std::pow(10.0, random(-6, 6));
    const Lanes y = inverse_cube_root(a);
    for (int i = 0; i < lane_count; ++i) {
      EXPECT_NEAR(y[i] * std::cbrt(a[i]), 1, 1e-15);
      EXPECT_EQ(y[i], inverse_cube_root(static_cast<double>(a[i])));
    }
  }
}

TEST(Lanes, InverseCubeRootOfOneAndPowersOfEight) {
  EXPECT_NEAR(inverse_cube_root(1.0), 1, std::numeric_limits<double>::epsilon());
  for (double a : {1e-6, 8e-6, 0.125, 8.0, 64.0, 1e6})
    EXPECT_NEAR(inverse_cube_root(a) * std::cbrt(a), 1, 4 * std::numeric_limits<double>::epsilon()) << a;
}

TEST(Lanes, SelectionsAndRoundings) {
  test::Random random;
  for (int k = 0; k < 1000; ++k) {
    const Lanes a = eight(random, -5, 5), b = eight(random, -5, 5), positive = eight(random, 0, 9);
    const Lanes chosen = select(a > b, a, b), constant = select(a > 0.0, a, -1.0), larger = maximum(a, b);
    const Lanes down = round_down(a), size = absolute(a), root = square_root(positive);
    for (int i = 0; i < lane_count; ++i) {
      EXPECT_EQ(chosen[i], a[i] > b[i] ? a[i] : b[i]);
      EXPECT_EQ(constant[i], a[i] > 0 ? a[i] : -1.0);
      EXPECT_EQ(larger[i], std::max<double>(a[i], b[i]));
      EXPECT_EQ(down[i], std::floor(a[i]));
      EXPECT_EQ(size[i], std::abs(a[i]));
      EXPECT_EQ(root[i], std::sqrt(positive[i]));
    }
  }
}

TEST(Lanes, RoundDownOfNegativeAndWholeNumbers) {
  for (double a : {-2.0, -1.5, -1e-300, 0.0, 0.999, 3.0}) {
    EXPECT_EQ(round_down(a), std::floor(a));
    EXPECT_EQ(round_down(broadcast(a))[7], std::floor(a));
  }
}

TEST(Lanes, LoadsAndStoresEveryLane) {
  alignas(64) double from[lane_count], to[lane_count], four[4];
  for (int i = 0; i < lane_count; ++i) from[i] = i + 0.25;
  store(to, load(from));
  store4(four, load4(from + 4));
  for (int i = 0; i < lane_count; ++i) EXPECT_EQ(to[i], i + 0.25);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(four[i], i + 4.25);
}

}  // namespace
}  // namespace cairn
