#pragma once
/// Closed surfaces of triangles, and what lies inside: where the generalised winding number (Jacobson, Kavan &
/// Sorkine-Hornung 2013), the solid angle of the surface over 4 pi, is above one half.

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "cairn/body/shapes/basics.hpp"

namespace cairn {

/// Triangles as files hold them; outward normals by the right-hand rule.
struct Triangles {
  std::vector<Vec3> points;
  std::vector<std::array<std::int32_t, 3>> corners;
};

/// What was found in a surface, and mended where that is possible. Places are in the file's lengths.
struct SurfaceFaults {
  std::int64_t open_edges = 0, shared_edges = 0;  // of one triangle, and of more than two
  std::int64_t flipped = 0, repeated = 0, flat = 0, crossings = 0;
  bool inside_out = false;
  Vec3 open_at = Vec3::Zero(), shared_at = Vec3::Zero(), flipped_at = Vec3::Zero(), repeated_at = Vec3::Zero(),
       crossing_at = Vec3::Zero();
  double largest_hole = 0;  // diagonal of the box around its edges
};

/// Points with the same coordinates become one; triangles with two equal corners and repeated ones are left out. Then
/// triangles that their neighbours contradict are turned, and whole parts where they enclose a negative volume and lie
/// within nothing.
SurfaceFaults mend(Triangles& surface);

/// As mend, for a surface that need not enclose anything: no part is turned as a whole, and crossings are not looked
/// for.
SurfaceFaults mend_sheet(Triangles& surface);

/// The number of pairs of triangles that pass through each other, and where the first does.
std::int64_t count_crossings(const Triangles& surface, Vec3& where);

/// A mended surface. What holds() finds costs little away from the triangles: the room is divided into cells, and in
/// those without a triangle one place stands for all. In a cell with triangles the winding number of one place is
/// known and a line to it counts the triangles between; a surface with holes is summed instead, far triangles by the
/// dipole of their areas (Barill et al. 2018).
class Solid {
 public:
  explicit Solid(Triangles triangles, bool closed);
  ~Solid();

  bool holds(const Vec3& x) const;
  const Bounds& bounds() const;
  const std::vector<Vec3>& points() const;
  std::size_t size() const;  // triangles
  double volume() const;
  Vec3 centroid() const;
  /// Of the material beneath the surface, along the inward normals; a twentieth of the area covers less.
  double thickness() const;
  /// Generalised winding number.
  double winding(const Vec3& x) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace cairn
