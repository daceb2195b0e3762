#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cairn/body/label_volume.hpp"

namespace cairn {
namespace {

/// A volume in memory, that notes the largest box that was asked for.
struct Voxels {
  std::array<std::int64_t, 3> size;
  std::vector<std::int64_t> labels;
  std::size_t largest = 0;

  template <class F>
  Voxels(const std::array<std::int64_t, 3>& n, F&& label) : size(n) {
    for (std::int64_t z = 0; z < n[2]; ++z)
      for (std::int64_t y = 0; y < n[1]; ++y)
        for (std::int64_t x = 0; x < n[0]; ++x) labels.push_back(label(x + 0.5, y + 0.5, z + 0.5));
  }
  LabelVolume volume(int dimension, std::vector<std::int64_t> known, double weight = 1) {
    std::vector<LabelFacts> facts;
    for (const auto label : known) facts.push_back({label, std::ranges::count(labels, label), {}, {}, 1, weight});
    return {dimension, size, Vec3::Zero(), Vec3::Ones(), facts, [this](const auto& low, const auto& n, auto to) {
              largest = std::max(largest, to.size());
              std::size_t i = 0;
              for (std::int64_t z = low[2]; z < low[2] + n[2]; ++z)
                for (std::int64_t y = low[1]; y < low[1] + n[1]; ++y)
                  for (std::int64_t x = low[0]; x < low[0] + n[0]; ++x)
                    to[i++] = labels.at((z * size[1] + y) * size[0] + x);
            }};
  }
};

TEST(LabelVolume, FlatFacesStayWhereTheyAreAndNothingIsHeldTwiceOrNotAtAll) {
  Voxels voxels({70, 50, 40}, [](double x, double, double) { return x < 35 ? 5 : 300; });
  const LabelVolume volume = voxels.volume(3, {5, 300});
  for (int i = 0; i < 700; ++i)
    for (int j = 0; j < 20; ++j) {
      const double x = (i + 0.5) / 10;
      EXPECT_EQ(volume.label_at({x, 2.5 * j + 0.3, 2.0 * j + 0.01}), x < 35 ? 0 : 1) << x;
    }
  EXPECT_EQ(volume.label_at({-0.01, 5, 5}), -1);
  EXPECT_EQ(volume.label_at({70.01, 5, 5}), -1);
  EXPECT_LT(voxels.largest, 40U * 40 * 40) << "never the whole volume at once";
}

TEST(LabelVolume, ADiscIsRoundThoughItsVoxelsAreStairs) {
  constexpr double r = 16.3;
  const Vec3 centre(24.2, 23.9, 0);
  Voxels voxels({48, 48, 1},
                [&](double x, double y, double) { return std::hypot(x - centre.x(), y - centre.y()) < r ? 1 : 0; });
  const LabelVolume volume = voxels.volume(2, {1});
  constexpr int directions = 720;
  const auto roughness = [&](auto&& inside) {  // standard deviation of the radius, in voxels
    double sum = 0, squares = 0;
    for (int i = 0; i < directions; ++i) {
      const double t = 2 * std::numbers::pi * i / directions;
      double d = r - 2;
      while (inside(Vec3(centre + d * Vec3(std::cos(t), std::sin(t), 0)))) d += 0.01;
      sum += d, squares += d * d;
    }
    return std::sqrt(squares / directions - std::pow(sum / directions, 2));
  };
  const double smooth = roughness([&](const Vec3& x) { return volume.label_at(x) == 0; });
  const double stairs =
      roughness([&](const Vec3& x) { return voxels.labels[std::size_t(x.y()) * 48 + std::size_t(x.x())] == 1; });
  EXPECT_GT(stairs, 0.25);
  EXPECT_LT(smooth, 0.6 * stairs);
}

TEST(LabelVolume, AWeightMovesTheSurfaceOutwards) {
  Voxels voxels({40, 1, 1}, [](double x, double, double) { return x > 10 && x < 30 ? 1 : 0; });
  const auto width = [&](double weight) {
    const LabelVolume volume = voxels.volume(3, {1}, weight);
    int inside = 0;
    for (int i = 0; i < 4000; ++i) inside += volume.label_at({(i + 0.5) / 100, 0.5, 0.5}) == 0;
    return inside / 100.0;
  };
  EXPECT_NEAR(width(1), 20, 0.011);
  EXPECT_NEAR(width(std::exp(0.5)), 20 + 2 * 0.5 * 0.65, 0.12);
}

}  // namespace
}  // namespace cairn
