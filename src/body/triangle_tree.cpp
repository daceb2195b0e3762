#include "triangle_tree.hpp"

#include <algorithm>
#include <numbers>
#include <numeric>

namespace cairn {

TriangleTree::TriangleTree(const Triangles& surface) : surface_(surface), order_(surface.corners.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  for (const auto& c : surface.corners) {
    Bounds box = shapes::nothing();
    for (const auto corner : c) shapes::widen(box, surface.points[corner]);
    boxes_.push_back(box);
    middles_.push_back(0.5 * (box.lower + box.upper));
  }
  nodes_.reserve(surface.corners.size());
  build(0, static_cast<std::int32_t>(order_.size()));
}

std::int32_t TriangleTree::build(std::int32_t first, std::int32_t count) {
  const auto at = static_cast<std::int32_t>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  Bounds middles = shapes::nothing();
  double weight = 0;
  for (std::int32_t k = first; k < first + count; ++k) {
    const auto& c = surface_.corners[order_[k]];
    const Vec3 &a = surface_.points[c[0]], &b = surface_.points[c[1]], &d = surface_.points[c[2]];
    const Vec3 area = 0.5 * (b - a).cross(d - a);
    const double size = area.norm();
    node.area += area, node.centre += size / 3 * (a + b + d), weight += size;
    shapes::widen(node.box, boxes_[order_[k]].lower), shapes::widen(node.box, boxes_[order_[k]].upper);
    shapes::widen(middles, middles_[order_[k]]);
  }
  node.centre = weight > 0 ? (node.centre / weight).eval() : (0.5 * (node.box.lower + node.box.upper)).eval();
  node.reach = (node.box.upper - node.centre).cwiseMax(node.centre - node.box.lower).norm();
  if (count <= leaf) {
    node.first = first, node.count = count;
  } else {
    int axis = 0;
    (middles.upper - middles.lower).maxCoeff(&axis);
    const std::int32_t half = count / 2;
    std::nth_element(order_.begin() + first, order_.begin() + first + half, order_.begin() + first + count,
                     [&](auto i, auto j) { return std::pair(middles_[i][axis], i) < std::pair(middles_[j][axis], j); });
    build(first, half);
    node.right = build(first + half, count - half);
  }
  nodes_[at] = node;
  return at;
}

/// Van Oosterom & Strackee (1983), eq. 8.
double TriangleTree::angle(std::int32_t triangle, const Vec3& x) const {
  const auto& corners = surface_.corners[triangle];
  const Vec3 a = surface_.points[corners[0]] - x, b = surface_.points[corners[1]] - x,
             c = surface_.points[corners[2]] - x;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

double TriangleTree::winding(const Vec3& x) const {
  constexpr double far = 2.0;  // reaches away
  double sum = 0;
  std::vector<std::int32_t> stack = {0};
  while (!stack.empty()) {
    const std::int32_t at = stack.back();
    const Node& node = nodes_[at];
    stack.pop_back();
    const Vec3 d = node.centre - x;
    const double distance = d.norm();
    if (distance > far * node.reach) {
      sum += node.area.dot(d) / (distance * distance * distance);
    } else if (node.count == 0) {
      stack.push_back(node.right), stack.push_back(at + 1);
    } else {
      for (std::int32_t k = node.first; k < node.first + node.count; ++k) sum += angle(order_[k], x);
    }
  }
  return sum / (4 * std::numbers::pi);
}

/// Möller & Trumbore (1997).
double TriangleTree::hit(std::int32_t triangle, const Vec3& from, const Vec3& along) const {
  const auto& c = surface_.corners[triangle];
  const Vec3 a = surface_.points[c[0]], e1 = surface_.points[c[1]] - a, e2 = surface_.points[c[2]] - a;
  const Vec3 p = along.cross(e2), s = from - a, q = s.cross(e1);
  const double det = e1.dot(p);
  if (det == 0) return shapes::infinity;
  const double u = s.dot(p) / det, v = along.dot(q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 ? e2.dot(q) / det : shapes::infinity;
}

double TriangleTree::first_hit(const Vec3& from, const Vec3& along, double least) const {
  double nearest = shapes::infinity;
  const auto entry = [&](const Bounds& box) {
    double low = 0, high = nearest;
    for (int k = 0; k < 3; ++k) {
      const double a = (box.lower[k] - from[k]) / along[k], b = (box.upper[k] - from[k]) / along[k];
      if (along[k] == 0 && (from[k] < box.lower[k] || from[k] > box.upper[k])) return shapes::infinity;
      if (along[k] != 0) low = std::max(low, std::min(a, b)), high = std::min(high, std::max(a, b));
    }
    return low <= high ? low : shapes::infinity;
  };
  std::vector<std::int32_t> stack = {0};
  while (!stack.empty()) {
    const std::int32_t at = stack.back();
    const Node& node = nodes_[at];
    stack.pop_back();
    if (!std::isfinite(entry(node.box))) continue;
    if (node.count == 0) stack.push_back(node.right), stack.push_back(at + 1);
    for (std::int32_t k = node.first; k < node.first + node.count; ++k)
      if (const double t = hit(order_[k], from, along); t > least) nearest = std::min(nearest, t);
  }
  return nearest;
}

}  // namespace cairn
