#pragma once
/// A tree of boxes around triangles.

#include <vector>

#include "cairn/body/solid.hpp"

namespace cairn {

class TriangleTree {
 public:
  explicit TriangleTree(const Triangles& surface);

  Bounds bounds() const { return nodes_[0].box; }
  /// Generalised winding number of the surface about x; far triangles by the dipole of their areas.
  double winding(const Vec3& x) const;
  /// Distance along a direction of length 1 to the first triangle that is further than `least`; infinite without one.
  double first_hit(const Vec3& from, const Vec3& along, double least) const;
  /// Calls f(i, j), i < j, for the pairs of triangles whose boxes overlap.
  template <class F>
  void for_near_pairs(F&& f) const;

 private:
  struct Node {
    Bounds box = shapes::nothing();
    Vec3 centre = Vec3::Zero(), area = Vec3::Zero();  // of the areas, and their sum as vectors
    double reach = 0;                                 // of the box about the centre
    std::int32_t first = 0, count = 0;                // triangles of a leaf
    std::int32_t right = 0;                           // of an inner node; the left one follows it
  };
  static constexpr int leaf = 6;

  std::int32_t build(std::int32_t first, std::int32_t count);
  double angle(std::int32_t triangle, const Vec3& x) const;  // solid angle [sr]
  double hit(std::int32_t triangle, const Vec3& from, const Vec3& along) const;

  const Triangles& surface_;
  std::vector<std::int32_t> order_;
  std::vector<Vec3> middles_;
  std::vector<Bounds> boxes_;
  std::vector<Node> nodes_;
};

inline bool overlap(const Bounds& a, const Bounds& b) {
  return (a.lower.array() <= b.upper.array()).all() && (b.lower.array() <= a.upper.array()).all();
}

template <class F>
void TriangleTree::for_near_pairs(F&& f) const {
  std::vector<std::int32_t> stack;
  for (std::int32_t i = 0; i < std::ssize(boxes_); ++i) {
    stack = {0};
    while (!stack.empty()) {
      const std::int32_t at = stack.back();
      const Node& node = nodes_[at];
      stack.pop_back();
      if (!overlap(node.box, boxes_[i])) continue;
      if (node.count == 0) {
        stack.push_back(node.right), stack.push_back(at + 1);
        continue;
      }
      for (std::int32_t k = node.first; k < node.first + node.count; ++k)
        if (order_[k] > i && overlap(boxes_[order_[k]], boxes_[i])) f(i, order_[k]);
    }
  }
}

}  // namespace cairn
