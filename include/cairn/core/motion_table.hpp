#pragma once
/// A vector as a function of time.

#include <algorithm>
#include <cmath>
#include <vector>

#include "cairn/core/formula.hpp"
#include "cairn/core/types.hpp"

namespace cairn {

/// A constant; or piecewise linear between given times, constant before the first and after the last, or going round
/// from there; or formulas of t.
struct MotionTable {
  std::vector<double> times;  // ascending [s]
  std::vector<Vec3> values = {Vec3::Zero()};
  bool repeat = false;            // after the last time comes the first again
  std::vector<Formula> formulas;  // x, y, z; or none
  double start = 0;               // from where time counts: the beginning of the stage that gave it [s]

  MotionTable() = default;
  MotionTable(const Vec3& constant) : values{constant} {}

  bool varies() const { return !times.empty() || !formulas.empty(); }
  bool is_zero() const {
    return formulas.empty() && std::ranges::all_of(values, [](const Vec3& v) { return v == Vec3::Zero(); });
  }
  /// The largest size; of formulas, the largest met at 65 times up to `until`.
  double largest(double until = 0) const {
    double most = 0;
    if (formulas.empty()) {
      for (const Vec3& v : values) most = std::max(most, v.norm());
      return most;
    }
    for (int i = 0; i <= 64; ++i)
      most = std::max(most, at(start + (std::isfinite(until) ? i / 64.0 * until : 0)).norm());
    return most;
  }
  Vec3 at(double t) const {
    t -= start;
    if (!formulas.empty()) return {formulas[0].at(t), formulas[1].at(t), formulas[2].at(t)};
    if (!varies()) return values.front();
    const double period = times.back() - times.front();
    if (repeat && period > 0 && t > times.back()) t -= std::floor((t - times.front()) / period) * period;
    const auto after = std::upper_bound(times.begin(), times.end(), t) - times.begin();
    if (after == 0) return values.front();
    if (after == std::ssize(times)) return values.back();
    const double share = (t - times[after - 1]) / (times[after] - times[after - 1]);
    return (1 - share) * values[after - 1] + share * values[after];
  }
  /// Whether both were given alike, whenever.
  bool same_as(const MotionTable& other) const {
    return times == other.times && values == other.values && repeat == other.repeat && formulas == other.formulas;
  }
};

}  // namespace cairn
