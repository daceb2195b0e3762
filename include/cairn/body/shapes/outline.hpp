#pragma once
/// Area within closed lines from a file (2D only): where an odd number of them goes round a place.

#include "cairn/body/loops.hpp"
#include "cairn/body/shapes/placement.hpp"

namespace cairn {

struct Outline : FromFile {
  static constexpr shapes::Names names = {"outline", ""};
  static constexpr bool round = true;

  std::string line;                      // its name, or "#N" by its number from 0; empty: all that the file holds
  std::shared_ptr<const Loops> loops{};  // in the file's lengths
  std::size_t count = 0;                 // of lines, while it stands for each of them

  template <class Self, class Keys>
  static void list(Self& s, Keys&& keys) {
    keys.file("file", s.file);
    keys.placement(s.placement);
    keys.text("line", s.line);
  }
  bool holds(const Vec3& x) const { return loops->holds(place.in_file(x)); }
  double width() const { return place.factor() * loops->thickness(); }
  Vec3 middle() const { return place.in_space(loops->centroid()); }
  double volume() const { return std::pow(place.factor(), 2) * loops->area(); }
};

}  // namespace cairn
