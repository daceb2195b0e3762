#pragma once
/// Disk (2D) or sphere (3D).

#include "cairn/body/shapes/basics.hpp"

namespace cairn {

struct Ball {
  static constexpr shapes::Names names = {"disk", "sphere"};
  static constexpr bool round = true;

  Vec3 centre;
  double radius;  // [m]

  template <class Self, class Keys>
  static void list(Self& s, Keys&& keys) {
    keys.vector("centre", s.centre);
    keys.positive("radius", s.radius);
  }
  bool holds(const Vec3& x) const { return (x - centre).squaredNorm() <= radius * radius * (1 + shapes::margin); }
  Bounds extent() const { return shapes::around(centre, Vec3::Constant(radius)); }
  double width() const { return 2 * radius; }
  void shift(const Vec3& way) { centre += way; }
};

}  // namespace cairn
