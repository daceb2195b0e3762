#pragma once
/// The side of a plane that `normal` points away from.

#include "cairn/body/shapes/basics.hpp"

namespace cairn {

struct HalfSpace {
  static constexpr shapes::Names names = {"half_space", "half_space"};

  Vec3 point, normal;

  template <class Self, class Keys>
  static void list(Self& s, Keys&& keys) {
    keys.vector("point", s.point);
    keys.vector("normal", s.normal);
  }
  std::optional<shapes::Problem> problem(int /*dimension*/) const {
    if (normal.norm() != 0) return std::nullopt;
    return shapes::Problem{"normal", "is zero; it must have a length"};
  }
  bool holds(const Vec3& x) const {
    const Vec3 d = x - point;
    return d.dot(normal) <= shapes::margin * d.norm() * normal.norm();
  }
  Bounds extent() const {
    Bounds all{Vec3::Constant(-shapes::infinity), Vec3::Constant(shapes::infinity)};
    cut(all, point, normal);
    return all;
  }
  double width() const { return shapes::infinity; }
  void shift(const Vec3& way) { point += way; }

  /// Draws the bounds in to those of their part on the side of the plane that `normal` points away from.
  static void cut(Bounds& box, const Vec3& point, const Vec3& normal) {
    for (int k = 0; k < 3; ++k) {
      if (normal[k] == 0) continue;
      double room = normal[k] * point[k];  // normal_k x_k is at most this, whatever the other coordinates are
      for (int j = 0; j < 3; ++j) {
        if (j == k || normal[j] == 0) continue;
        room += normal[j] * (point[j] - (normal[j] > 0 ? box.lower[j] : box.upper[j]));
      }
      if (!std::isfinite(room)) continue;
      if (normal[k] > 0) box.upper[k] = std::min(box.upper[k], room / normal[k]);
      if (normal[k] < 0) box.lower[k] = std::max(box.lower[k], room / normal[k]);
    }
  }
};

}  // namespace cairn
