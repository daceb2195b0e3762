#pragma once
/// Simple polygon in the x-y plane, in either orientation (2D only).

#include <utility>
#include <vector>

#include "cairn/body/shapes/basics.hpp"

namespace cairn {

struct Polygon {
  static constexpr shapes::Names names = {"polygon", ""};

  std::vector<Vec3> points;

  template <class Self, class Keys>
  static void list(Self& s, Keys&& keys) {
    keys.vectors("points", s.points);
  }
  std::optional<shapes::Problem> problem(int dimension) const;
  bool holds(const Vec3& x) const;
  Bounds extent() const {
    Bounds all = shapes::nothing();
    for (const Vec3& p : points) shapes::widen(all, p);
    return all;
  }
  /// Least distance between two lines along an edge which hold the polygon between them.
  double width() const;
  void shift(const Vec3& way) {
    for (Vec3& x : points) x += way;
  }
};

namespace shapes {
/// An edge of a closed line, in the x-y plane.
struct Edge {
  Vec3 from, to;
  std::size_t next;  // the edge that begins where this one ends
};
/// Two edges that meet elsewhere than at the point they follow each other at; nothing where there are none. Edges are
/// compared with those that overlap them in x.
std::optional<std::pair<std::size_t, std::size_t>> crossing_edges(const std::vector<Edge>& edges);
/// The points without those that repeat the one before, the first at the end among them.
std::vector<Vec3> without_repeated(const std::vector<Vec3>& points);
/// Appends the edges of the closed line through these points.
void add_edges(const std::vector<Vec3>& points, std::vector<Edge>& edges);
}  // namespace shapes

}  // namespace cairn
