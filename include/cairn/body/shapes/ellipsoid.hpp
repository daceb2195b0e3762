#pragma once
/// Ellipse (2D) or ellipsoid (3D) with half-axes `radii` [m], turned by `angle` [rad] about z.

#include "cairn/body/shapes/basics.hpp"

namespace cairn {

struct Ellipsoid {
  static constexpr shapes::Names names = {"ellipse", "ellipsoid"};
  static constexpr bool round = true;

  Vec3 centre, radii;
  double angle = 0;

  template <class Self, class Keys>
  static void list(Self& s, Keys&& keys) {
    keys.vector("centre", s.centre);
    keys.positive("radii", s.radii);
    keys.angle("angle", s.angle);
  }
  bool holds(const Vec3& x) const {
    const Vec3 d = shapes::local(x, centre, angle);
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      if (radii[k] > 0) sum += d[k] * d[k] / (radii[k] * radii[k]);
    }
    return sum <= 1 + shapes::margin;
  }
  Bounds extent() const {
    const double cs = std::cos(angle), sn = std::sin(angle);
    const double a = radii.x(), b = radii.y();
    return shapes::around(centre, {std::hypot(cs * a, sn * b), std::hypot(sn * a, cs * b), radii.z()});
  }
  double width() const { return 2 * shapes::least_positive(radii); }
  void shift(const Vec3& way) { centre += way; }
};

}  // namespace cairn
