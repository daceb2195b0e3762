#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <sstream>

#include "cairn/body/pack.hpp"
#include "cairn/core/error.hpp"

namespace cairn {
namespace {

constexpr double pi = std::numbers::pi;

PackSpec shear_spec() {
  PackSpec s;
  s.upper = Vec3(1.2e-3, 1.2e-3, 0);
  s.periodic = {false, true, false};
  s.walls = PackWalls::overlap;
  s.count = 369;
  s.fraction = 0.85;
  s.sizes.type = SizeType::fit;
  s.sizes.min = 31e-6;
  s.sizes.max = 250e-6;
  s.sizes.mean = 57e-6;
  return s;
}

/// `count` grains with diameters in the ratio `ratio`, scaled to the fraction, in a unit box without walls.
PackSpec periodic_spec(int dimension, int count, double ratio, double fraction) {
  PackSpec s;
  s.dimension = dimension;
  s.upper = Vec3::Ones();
  s.periodic = {true, true, true};
  s.count = count;
  s.fraction = fraction;
  s.sizes.min = 1;
  s.sizes.max = ratio;
  s.sizes.scale = true;
  return s;
}

/// Largest overlap, of the smaller radius, over all pairs and all neighbouring images.
double brute_force_overlap(const Pack& pack, const PackSpec& spec) {
  double largest = 0;
  const int ny = spec.periodic[1] ? 1 : 0, nx = spec.periodic[0] ? 1 : 0;
  const int nz = spec.dimension == 3 && spec.periodic[2] ? 1 : 0;
  const Vec3 box = spec.upper - spec.lower;
  for (std::size_t i = 0; i < pack.radius.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      for (int a = -nx; a <= nx; ++a) {
        for (int b = -ny; b <= ny; ++b) {
          for (int c = -nz; c <= nz; ++c) {
            if (i == j && a == 0 && b == 0 && c == 0) continue;
            const Vec3 d = pack.centre[i] - pack.centre[j] + Vec3(a * box.x(), b * box.y(), c * box.z());
            const double depth = pack.radius[i] + pack.radius[j] - d.norm();
            largest = std::max(largest, depth / std::min(pack.radius[i], pack.radius[j]));
          }
        }
      }
    }
  }
  return largest;
}

void expect_sound(const Pack& pack, const PackSpec& spec) {
  const double overlap = brute_force_overlap(pack, spec);
  EXPECT_LE(overlap, spec.max_overlap);
  EXPECT_NEAR(pack.max_overlap, overlap, 1e-9);
  for (std::size_t i = 0; i < pack.radius.size(); ++i) {
    for (int k = 0; k < spec.dimension; ++k) {
      const double room = !spec.periodic[k] && spec.walls == PackWalls::inside ? pack.radius[i] : 0.0;
      EXPECT_GE(pack.centre[i][k], spec.lower[k] + room * (1 - 1e-12));
      EXPECT_LE(pack.centre[i][k], spec.upper[k] - room * (1 - 1e-12));
    }
  }
}

double whole_fraction(const Pack& pack, const PackSpec& spec) {
  double sum = 0, box = 1;
  for (double r : pack.radius) sum += spec.dimension == 2 ? pi * r * r : 4.0 / 3 * pi * r * r * r;
  for (int k = 0; k < spec.dimension; ++k) box *= spec.upper[k] - spec.lower[k];
  return sum / box;
}

TEST(Pack, ShearOfThePaperHoldsItsSizesAndFraction) {
  const PackSpec spec = shear_spec();
  const Pack pack = pack_grains(spec);
  expect_sound(pack, spec);
  ASSERT_EQ(pack.radius.size(), 369u);
  EXPECT_DOUBLE_EQ(2 * pack.radius.front(), 250e-6);
  EXPECT_DOUBLE_EQ(2 * pack.radius.back(), 31e-6);
  const double mean = 2 * std::accumulate(pack.radius.begin(), pack.radius.end(), 0.0) / 369;
  EXPECT_NEAR(mean, 57e-6, 1e-10);
  EXPECT_NEAR(pack.mean_diameter, mean, 1e-15);
  EXPECT_NEAR(pack.fraction, 0.85, 1e-3);
  const auto crosses = [&](auto test) {
    int count = 0;
    for (std::size_t i = 0; i < 369; ++i) count += test(pack.centre[i].x(), pack.radius[i]);
    return count;
  };
  EXPECT_GT(crosses([](double x, double r) { return x < r; }), 10);
  EXPECT_GT(crosses([](double x, double r) { return x > 1.2e-3 - r; }), 10);
}

TEST(Pack, FractionCountsThePartsInside) {
  const PackSpec spec = shear_spec();
  const Pack pack = pack_grains(spec);
  // The share of the square covered, on points 2 um apart: y is periodic, x is cut.
  const int n = 600;
  std::vector<char> covered(n * n, 0);
  const double h = 1.2e-3 / n;
  for (std::size_t i = 0; i < pack.radius.size(); ++i) {
    const double r = pack.radius[i];
    const Vec3 c = pack.centre[i];
    for (int b = static_cast<int>(std::floor((c.y() - r) / h)); b <= (c.y() + r) / h; ++b) {
      for (int a = std::max(0, static_cast<int>((c.x() - r) / h)); a < std::min<double>(n, (c.x() + r) / h); ++a) {
        if (std::hypot((a + 0.5) * h - c.x(), (b + 0.5) * h - c.y()) <= r) covered[((b + n) % n) * n + a] = 1;
      }
    }
  }
  const double share = std::accumulate(covered.begin(), covered.end(), 0.0) / (n * n);
  EXPECT_NEAR(pack.fraction, share, 1e-3);
  EXPECT_LT(share, whole_fraction(pack, spec) - 0.005);
}

TEST(Pack, SameSeedSameBits) {
  const PackSpec spec = shear_spec();
  const Pack a = pack_grains(spec), b = pack_grains(spec);
  EXPECT_EQ(a.radius, b.radius);
  EXPECT_EQ(a.centre, b.centre);
  PackSpec other = spec;
  other.seed = 2;
  EXPECT_NE(pack_grains(other).centre, a.centre);
}

TEST(Pack, TableReadsBackToTheSameBits) {
  PackSpec spec = periodic_spec(2, 50, 1.5, 0.7);
  const Pack pack = pack_grains(spec);
  std::istringstream file(pack_table(pack, spec));
  std::string line;
  std::size_t row = 0;
  bool header = false;
  while (std::getline(file, line)) {
    if (line.starts_with("#")) continue;
    if (!header) {
      EXPECT_EQ(line, "x,y,r");
      header = true;
      continue;
    }
    double x = 0, y = 0, r = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &x, &y, &r), 3) << line;
    ASSERT_LT(row, pack.radius.size());
    EXPECT_EQ(Vec3(x, y, 0), pack.centre[row]);
    EXPECT_EQ(r, pack.radius[row++]);
  }
  EXPECT_EQ(row, pack.radius.size());
}

TEST(Pack, PeriodicInBothDirections) {
  const PackSpec spec = periodic_spec(2, 600, 2.0, 0.83);
  const Pack pack = pack_grains(spec);
  expect_sound(pack, spec);
  EXPECT_NEAR(pack.fraction, 0.83, 1e-10);
  EXPECT_NEAR(whole_fraction(pack, spec), 0.83, 1e-10);
  EXPECT_NEAR(pack.radius.front() / pack.radius.back(), 2.0, 1e-12);
}

TEST(Pack, WallsKeepGrainsInside) {
  PackSpec spec = periodic_spec(2, 300, 1.5, 0.78);
  spec.lower = Vec3(-2, 3, 0);
  spec.upper = Vec3(0, 4, 0);
  spec.periodic = {false, false, false};
  const Pack pack = pack_grains(spec);
  expect_sound(pack, spec);
  EXPECT_NEAR(pack.fraction, 0.78, 1e-10);
}

TEST(Pack, SpheresPeriodicAndBetweenWalls) {
  PackSpec spec = periodic_spec(3, 500, 1.2, 0.60);
  const Pack pack = pack_grains(spec);
  expect_sound(pack, spec);
  EXPECT_NEAR(pack.fraction, 0.60, 1e-10);
  spec = periodic_spec(3, 64, 1.2, 0.48);
  spec.periodic = {false, false, false};
  expect_sound(pack_grains(spec), spec);
  spec.walls = PackWalls::overlap;
  spec.fraction = 0.5;
  const Pack cut = pack_grains(spec);
  expect_sound(cut, spec);
  EXPECT_NEAR(cut.fraction, 0.5, 1e-3);
}

TEST(Pack, WideRangeOfSizes) {
  const PackSpec spec = periodic_spec(2, 800, 30.0, 0.80);
  expect_sound(pack_grains(spec), spec);
}

TEST(Pack, LognormalMeanAndWidthAreDelivered) {
  PackSpec spec = periodic_spec(2, 0, 1, 0.8);
  spec.sizes = {};
  spec.sizes.type = SizeType::lognormal;
  spec.sizes.mean = 0.03;
  spec.sizes.sigma = 0.3;
  const Pack pack = pack_grains(spec);
  EXPECT_NEAR(pack.mean_diameter, 0.03, 1e-9);
  EXPECT_NEAR(pack.fraction, 0.8, 0.5 * pi / 4 * 0.03 * 0.03 * 1.1);
  double mean_log = 0, square_log = 0;
  for (double r : pack.radius) mean_log += std::log(2 * r) / pack.radius.size();
  for (double r : pack.radius) square_log += std::pow(std::log(2 * r) - mean_log, 2) / pack.radius.size();
  EXPECT_NEAR(std::sqrt(square_log), 0.3, 5e-3);
  spec.sizes.min = 0.02;
  spec.sizes.max = 0.05;
  const Pack cut = pack_grains(spec);
  EXPECT_NEAR(cut.mean_diameter, 0.03, 1e-9);
  EXPECT_LE(2 * cut.radius.front(), 0.05);
  EXPECT_GE(2 * cut.radius.back(), 0.02);
}

TEST(Pack, ListIsSharedOutByWeight) {
  PackSpec spec = periodic_spec(2, 100, 1, 0.8);
  spec.sizes.type = SizeType::list;
  spec.sizes.diameters = {1.0, 1.4, 2.0};
  spec.sizes.weights = {2, 1, 1};
  const Pack pack = pack_grains(spec);
  expect_sound(pack, spec);
  const double small = pack.radius.back();
  const auto of_size = [&](double d) {
    return std::count_if(pack.radius.begin(), pack.radius.end(),
                         [&](double r) { return std::abs(r / small - d) < 1e-9; });
  };
  EXPECT_EQ(of_size(1.0), 50);
  EXPECT_EQ(of_size(1.4), 25);
  EXPECT_EQ(of_size(2.0), 25);
}

TEST(Pack, CountAndFractionFollowFromEachOther) {
  PackSpec spec = shear_spec();
  spec.count = 0;
  const Pack counted = pack_grains(spec);
  EXPECT_NEAR(static_cast<double>(counted.radius.size()), 369, 40);
  EXPECT_NEAR(counted.fraction, 0.85, 1e-3);
  EXPECT_NEAR(counted.mean_diameter, 57e-6, 1e-10);
  spec = shear_spec();
  spec.fraction = 0;
  spec.count = 300;
  const Pack filled = pack_grains(spec);
  EXPECT_EQ(filled.radius.size(), 300u);
  EXPECT_NEAR(filled.mean_diameter, 57e-6, 1e-10);
  EXPECT_NEAR(filled.fraction, 0.7, 0.1);
}

TEST(Pack, PartOfADiskInsideABox) {
  const Vec3 low(0, 0, 0), high(10, 10, 0);
  const std::array<bool, 3> cut{}, open{false, true, false};
  EXPECT_NEAR(volume_inside(2, {5, 5, 0}, 1, low, high, cut), pi, 1e-14);
  EXPECT_NEAR(volume_inside(2, {0, 5, 0}, 1, low, high, cut), pi / 2, 1e-14);
  EXPECT_NEAR(volume_inside(2, {0, 0, 0}, 2, low, high, cut), pi, 1e-14);
  EXPECT_NEAR(volume_inside(2, {0, 0, 0}, 2, low, high, open), 2 * pi, 1e-14);
  EXPECT_NEAR(volume_inside(2, {0.5, 5, 0}, 1, low, high, cut), pi - (pi / 3 - std::sqrt(3.0) / 4), 1e-14);
  EXPECT_NEAR(volume_inside(2, {5, 5, 0}, 100, low, high, cut), 100, 1e-9);
  EXPECT_EQ(volume_inside(2, {-2, 5, 0}, 1, low, high, cut), 0);
  // A corner inside the disk, against counting.
  const Vec3 c(0.3, 9.5, 0);
  long count = 0;
  for (int i = 0; i < 2000; ++i) {
    for (int j = 0; j < 2000; ++j) {
      const double x = (i + 0.5) * 1e-3, y = 10 - (j + 0.5) * 1e-3;
      count += (x - c.x()) * (x - c.x()) + (y - c.y()) * (y - c.y()) <= 1;
    }
  }
  EXPECT_NEAR(volume_inside(2, c, 1, low, high, cut), count * 1e-6, 1e-4);
}

TEST(Pack, PartOfASphereInsideABox) {
  const Vec3 low(0, 0, 0), high(10, 10, 10);
  const std::array<bool, 3> cut{}, open{false, false, true};
  const double whole = 4.0 / 3 * pi;
  EXPECT_NEAR(volume_inside(3, {5, 5, 5}, 1, low, high, cut), whole, 1e-12);
  EXPECT_NEAR(volume_inside(3, {0, 5, 5}, 1, low, high, cut), whole / 2, 1e-5);
  EXPECT_NEAR(volume_inside(3, {5, 10, 0}, 1, low, high, cut), whole / 4, 1e-5);
  EXPECT_NEAR(volume_inside(3, {0, 0, 0}, 1, low, high, cut), whole / 8, 1e-5);
  EXPECT_NEAR(volume_inside(3, {0, 0, 0}, 1, low, high, open), whole / 4, 1e-5);
  const double cap = pi * 0.25 * (3 - 0.5) / 3;  // height 0.5
  EXPECT_NEAR(volume_inside(3, {5, 5, 0.5}, 1, low, high, cut), whole - cap, 1e-5);
  EXPECT_NEAR(volume_inside(3, {0.5, 5, 5}, 1, low, high, cut), whole - cap, 1e-5);
}

void expect_refused(const PackSpec& spec, const std::string& words) {
  const auto errors = check_pack(spec);
  ASSERT_FALSE(errors.empty()) << words;
  EXPECT_THROW(pack_grains(spec), InputError);
  EXPECT_NE(errors.front().find(words), std::string::npos) << errors.front();
}

TEST(Pack, SpecsThatContradictThemselvesAreRefused) {
  PackSpec s = periodic_spec(2, 100, 1, 0.8);
  s.sizes.scale = false;
  s.sizes.min = s.sizes.max = 0.05;
  expect_refused(s, "fraction of 0.1963 of the box, not 0.8");
  expect_refused(s, "it would be 407");
  s = shear_spec();
  s.count = 100;
  expect_refused(s, "contradict each other");
  s = shear_spec();
  s.count = 1000;
  expect_refused(s, "contradict each other");
  s = shear_spec();
  s.sizes.mean = 20e-6;
  expect_refused(s, "sizes.mean = 2e-05");
  s = shear_spec();
  s.count = 0;
  s.fraction = 0;
  expect_refused(s, "one of them is needed");
  s = periodic_spec(2, 3, 1, 0.6);
  expect_refused(s, "in a periodic direction");
  s = periodic_spec(2, 10, 1, 0.8);
  s.upper.x() = 0;
  expect_refused(s, "no extent along x");
  s = periodic_spec(2, 10, 1, 1.2);
  expect_refused(s, "pack.fraction = 1.2");
  s.dimension = 4;
  s.max_overlap = 0;
  EXPECT_GE(check_pack(s).size(), 1u);
  EXPECT_TRUE(check_pack(shear_spec()).empty());
}

TEST(Pack, FractionOutOfReachSaysWhatWasReached) {
  try {
    pack_grains(periodic_spec(2, 20, 1.4, 0.95));
    FAIL() << "no pack of such disks is that dense";
  } catch (const RunError& e) {
    EXPECT_NE(std::string(e.what()).find("not reached"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("lower fraction (try 0."), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace cairn
