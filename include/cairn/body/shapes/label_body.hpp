#pragma once
/// One label of an image (2D) or a volume (3D) of labels. It comes from [[labels]] and has no keys of its own.

#include "cairn/body/label_volume.hpp"
#include "cairn/body/shapes/placement.hpp"

namespace cairn {

struct LabelBody {
  static constexpr shapes::Names names = {"", ""};
  static constexpr bool round = true;

  std::shared_ptr<const LabelVolume> labels;
  int index = 0;  // of the label in the volume's table
  Place place;
  Bounds box;
  std::uint64_t checksum = 0;  // of the file

  template <class Self, class Keys>
  static void list(Self& s, Keys&& keys) {
    keys.plain(s.labels->facts(s.index).label), keys.plain(s.checksum);
    keys.plain(s.place.factor());
    keys.plain(s.box.lower), keys.plain(s.box.upper);
  }
  bool holds(const Vec3& x) const { return labels->label_at(place.in_file(x)) == index; }
  Bounds extent() const { return box; }
  double width() const { return 2 * inner_radius(); }
  void shift(const Vec3& way) { place.shift(way), box.lower += way, box.upper += way; }
  Vec3 middle() const { return place.in_space(labels->facts(index).inner_centre); }
  double volume() const { return std::pow(place.factor(), labels->dimension()) * labels->volume_of(index); }

  /// Of the largest ball about middle() that lies within.
  double inner_radius() const { return place.factor() * labels->facts(index).inner_radius; }
};

}  // namespace cairn
