#pragma once
/// What the shapes of bodies are made of (CONTRIBUTING.md, "Add a shape").

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "cairn/core/types.hpp"

namespace cairn {

/// Axis-aligned bounds [m]; may be infinite.
struct Bounds {
  Vec3 lower, upper;
};

namespace shapes {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// Relative margin by which the boundary counts as inside, so that rounding does not drop points that lie on it.
inline constexpr double margin = 1e-12;

/// Names of a shape in the case file; empty where there is none in that dimension.
struct Names {
  std::string_view in_2d, in_3d;
  std::string_view of(int dimension) const { return dimension == 2 ? in_2d : in_3d; }
};

/// What is wrong with values that are right one by one, and at which key.
struct Problem {
  std::string_view key;
  std::string text;
};

/// Coordinates of `x` in the frame of a shape centred at `c` and turned by `angle` about z.
inline Vec3 local(const Vec3& x, const Vec3& c, double angle) {
  Vec3 d = x - c;
  if (angle == 0) return d;
  const double cs = std::cos(angle), sn = std::sin(angle);
  return {cs * d.x() + sn * d.y(), cs * d.y() - sn * d.x(), d.z()};
}

inline Bounds around(const Vec3& c, const Vec3& half) { return {c - half, c + half}; }

/// Smallest of the widths above zero: in 2D the z extent is zero.
inline double least_positive(const Vec3& widths) {
  double least = infinity;
  for (double w : widths) {
    if (w > 0) least = std::min(least, w);
  }
  return least;
}

inline Bounds nothing() { return {Vec3::Constant(infinity), Vec3::Constant(-infinity)}; }

inline void widen(Bounds& all, const Vec3& x) {
  all.lower = all.lower.cwiseMin(x);
  all.upper = all.upper.cwiseMax(x);
}

}  // namespace shapes
}  // namespace cairn
