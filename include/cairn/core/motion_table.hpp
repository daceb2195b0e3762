#pragma once
/// A vector as a function of time.

#include <algorithm>
#include <cmath>
#include <vector>

#include "cairn/core/types.hpp"

namespace cairn {

/// Piecewise linear between given times, constant before the first and after the last, or going round from there.
/// Without times: one constant.
struct MotionTable {
  std::vector<double> times;  // ascending [s]
  std::vector<Vec3> values = {Vec3::Zero()};
  bool repeat = false;  // after the last time comes the first again

  MotionTable() = default;
  MotionTable(const Vec3& constant) : values{constant} {}

  bool varies() const { return !times.empty(); }
  bool is_zero() const {
    return std::ranges::all_of(values, [](const Vec3& v) { return v == Vec3::Zero(); });
  }
  double largest() const {
    double most = 0;
    for (const Vec3& v : values) most = std::max(most, v.norm());
    return most;
  }
  Vec3 at(double t) const {
    if (!varies()) return values.front();
    const double period = times.back() - times.front();
    if (repeat && period > 0 && t > times.back()) t -= std::floor((t - times.front()) / period) * period;
    const auto after = std::upper_bound(times.begin(), times.end(), t) - times.begin();
    if (after == 0) return values.front();
    if (after == std::ssize(times)) return values.back();
    const double share = (t - times[after - 1]) / (times[after] - times[after - 1]);
    return (1 - share) * values[after - 1] + share * values[after];
  }
  friend bool operator==(const MotionTable&, const MotionTable&) = default;
};

}  // namespace cairn
