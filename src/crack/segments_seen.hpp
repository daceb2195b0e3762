#pragma once
/// What lines from a face of a crack to the nodes around it may cross.

#include <optional>

#include "cairn/crack/faces.hpp"
#include "triangles_around.hpp"

namespace cairn {

/// Segments that lines from a face to the nodes around it may cross: of the own crack from where it begins, of others.
template <int Dim>
class SegmentsSeen {
 public:
  SegmentsSeen(const CrackSurroundings<Dim>& around, int crack, const Vec<Dim>& face, const Vec<Dim>& start)
      : own_(around.segments.near(start, around.lattice)), others_(around.segments.near(face, around.lattice)) {
    if constexpr (Dim == 3) {
      const Vec<Dim> reach = 1.51 * around.lattice.spacing();  // of the nodes nearest to the face
      const Vec<Dim> further = reach + (start - face).cwiseAbs();
      own_triangles_.emplace(around.segments, own_, start, further, [&](int c) { return c == crack; });
      other_triangles_.emplace(around.segments, others_, face, reach, [&](int c) { return c != crack; });
    }
  }
  std::span<const int> own(const Vec<Dim>& node) {
    if constexpr (Dim == 3) return own_triangles_->towards(node);
    return own_;
  }
  std::span<const int> others(const Vec<Dim>& node) {
    if constexpr (Dim == 3) return other_triangles_->towards(node);
    return others_;
  }

 private:
  std::span<const int> own_, others_;
  std::optional<TrianglesAround> own_triangles_, other_triangles_;
};

}  // namespace cairn
