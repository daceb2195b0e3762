#pragma once
/// Box along the axes, turned by `angle` [rad] about its centre (about z).

#include <fmt/format.h>

#include "cairn/body/shapes/basics.hpp"

namespace cairn {

struct BoxShape {
  static constexpr shapes::Names names = {"box", "box"};

  Vec3 lower, upper;
  double angle = 0;

  template <class Self, class Keys>
  static void list(Self& s, Keys&& keys) {
    keys.vector("lower", s.lower);
    keys.vector("upper", s.upper);
    keys.angle("angle", s.angle);
  }
  std::optional<shapes::Problem> problem(int dimension) const {
    for (int k = 0; k < dimension; ++k)
      if (!(upper[k] > lower[k]))
        return shapes::Problem{"upper", fmt::format("{} is not above lower ({}) in direction {}; it must be greater",
                                                    upper[k], lower[k], "xyz"[k])};
    return std::nullopt;
  }
  bool holds(const Vec3& x) const {
    const Vec3 half = 0.5 * (upper - lower);
    const Vec3 d = shapes::local(x, 0.5 * (lower + upper), angle).cwiseAbs();
    return (d.array() <= half.array() + shapes::margin * half.maxCoeff()).all();
  }
  Bounds extent() const {
    const Vec3 half = 0.5 * (upper - lower);
    if (angle == 0) return {lower, upper};
    const double cs = std::abs(std::cos(angle)), sn = std::abs(std::sin(angle));
    return shapes::around(0.5 * (lower + upper),
                          {cs * half.x() + sn * half.y(), sn * half.x() + cs * half.y(), half.z()});
  }
  double width() const { return shapes::least_positive(upper - lower); }
  void shift(const Vec3& way) { lower += way, upper += way; }
};

}  // namespace cairn
