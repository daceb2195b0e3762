#pragma once
/// Solid cylinder between the centres of its ends (3D only).

#include "cairn/body/shapes/basics.hpp"

namespace cairn {

struct Cylinder {
  static constexpr shapes::Names names = {"", "cylinder"};

  Vec3 from, to;
  double radius;  // [m]

  template <class Self, class Keys>
  static void list(Self& s, Keys&& keys) {
    keys.vector("from", s.from);
    keys.vector("to", s.to);
    keys.positive("radius", s.radius);
  }
  std::optional<shapes::Problem> problem(int /*dimension*/) const {
    if (from != to) return std::nullopt;
    return shapes::Problem{"to", "equals from; the cylinder must have a length"};
  }
  bool holds(const Vec3& x) const {
    const Vec3 axis = to - from, d = x - from;
    const double length2 = axis.squaredNorm(), along = d.dot(axis) / length2;
    return along >= -shapes::margin && along <= 1 + shapes::margin &&
           (d - along * axis).squaredNorm() <= radius * radius * (1 + shapes::margin);
  }
  Bounds extent() const {
    const Vec3 axis = (to - from).normalized();
    const Vec3 half = radius * (1 - axis.array().square()).max(0).sqrt().matrix();
    return {from.cwiseMin(to) - half, from.cwiseMax(to) + half};
  }
  double width() const { return std::min(2 * radius, (to - from).norm()); }
  void shift(const Vec3& way) { from += way, to += way; }
};

}  // namespace cairn
