#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cairn/body/label_volume.hpp"

namespace cairn {
namespace {

/// A volume in memory, that notes the largest box that was asked for. All voxels are as deep unless `depth` says it.
struct Voxels {
  std::array<std::int64_t, 3> size;
  std::vector<std::int64_t> labels;
  std::vector<std::uint8_t> depth;
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
    return {
        dimension, size, Vec3::Zero(), Vec3::Ones(), facts, [this](const auto& low, const auto& n, auto to, auto deep) {
          largest = std::max(largest, to.size());
          std::size_t i = 0;
          for (std::int64_t z = low[2]; z < low[2] + n[2]; ++z)
            for (std::int64_t y = low[1]; y < low[1] + n[1]; ++y)
              for (std::int64_t x = low[0]; x < low[0] + n[0]; ++x) {
                const auto at = static_cast<std::size_t>((z * size[1] + y) * size[0] + x);
                to[i] = labels.at(at), deep[i] = depth.empty() ? 100 : depth.at(at), ++i;
              }
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

TEST(LabelVolume, ADiscIsAsRoundAsItsDepthsSay) {
  constexpr double r = 16.3;
  const Vec3 centre(24.2, 23.9, 0);
  const auto below = [&](double x, double y) { return r - std::hypot(x - centre.x(), y - centre.y()); };
  Voxels voxels({48, 48, 1}, [&](double x, double y, double) { return below(x, y) > 0 ? 1 : 0; });
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 48; ++x)
      voxels.depth.push_back(
          static_cast<std::uint8_t>(std::clamp(std::round(std::abs(below(x + 0.5, y + 0.5)) * 170), 1.0, 255.0)));
  const LabelVolume volume = voxels.volume(2, {1});
  for (int i = 0; i < 720; ++i) {
    const double t = std::numbers::pi * i / 360;
    const Vec3 out(std::cos(t), std::sin(t), 0);
    EXPECT_EQ(volume.label_at(centre + (r - 0.04) * out), 0) << t;
    EXPECT_EQ(volume.label_at(centre + (r + 0.04) * out), -1) << t;
  }
}

TEST(LabelVolume, OfThreeLabelsTheOneWithTheLargestSumHoldsAPlace) {
  Voxels voxels({2, 2, 1}, [](double x, double y, double) { return y > 1 ? 9 : x > 1 ? 5 : 2; });
  voxels.depth = {60, 80, 50, 40};  // of the labels 2, 5, and 9 twice
  const LabelVolume volume = voxels.volume(2, {2, 5, 9});
  EXPECT_EQ(volume.label_at({1, 1, 0}), 2) << "a quarter of 50 + 40 is more than one of 80";
  EXPECT_EQ(volume.label_at({1, 0.85, 0}), 1);
  EXPECT_EQ(volume.label_at({0.6, 0.6, 0}), 0);
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
  EXPECT_NEAR(width(1.5), 20 + 2 * (0.6 - 0.5), 0.011) << "between middles, at 1.5 / (1.5 + 1)";
}

}  // namespace
}  // namespace cairn
