#pragma once
/// Closed surface of triangles from a file (3D only).

#include "cairn/body/shapes/placement.hpp"
#include "cairn/body/solid.hpp"

namespace cairn {

struct Mesh : FromFile {
  static constexpr shapes::Names names = {"", "mesh"};
  static constexpr bool round = true;

  std::string solid;                      // its name, or "#N" by its number from 0; empty: all that the file holds
  double holes = 0;                       // the largest that is closed [m]
  std::shared_ptr<const Solid> inside{};  // in the file's lengths
  std::size_t count = 0;                  // of solids, while it stands for each of them

  template <class Self, class Keys>
  static void list(Self& s, Keys&& keys) {
    keys.file("file", s.file);
    keys.placement(s.placement);
    keys.text("solid", s.solid);
    keys.not_negative("holes", s.holes);
  }
  bool holds(const Vec3& x) const { return inside->holds(place.in_file(x)); }
  double width() const { return place.factor() * inside->thickness(); }
  Vec3 middle() const { return place.in_space(inside->centroid()); }
  double volume() const { return std::pow(place.factor(), 3) * inside->volume(); }
};

}  // namespace cairn
