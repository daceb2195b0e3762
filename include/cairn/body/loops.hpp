#pragma once
/// Closed lines in the plane.

#include <vector>

#include "cairn/body/shapes/polygon.hpp"

namespace cairn {

class Loops {
 public:
  explicit Loops(const std::vector<std::vector<Vec3>>& lines);

  /// An odd number of the lines goes round the place.
  bool holds(const Vec3& x) const;
  Bounds bounds() const { return bounds_; }
  const std::vector<shapes::Edge>& edges() const { return edges_; }
  double area() const { return area_; }
  Vec3 centroid() const { return centroid_; }
  /// Of the material behind the edges, across them; a twentieth of their length covers less.
  double thickness() const { return thickness_; }

 private:
  /// The edges of the row of bands that holds y.
  const std::vector<std::int32_t>& band(double y) const;
  void measure();
  void measure_thickness();

  std::vector<shapes::Edge> edges_;
  std::vector<std::vector<std::int32_t>> bands_;
  Bounds bounds_;
  double area_ = 0, thickness_ = 0;
  Vec3 centroid_ = Vec3::Zero();
};

}  // namespace cairn
