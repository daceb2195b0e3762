#include "cairn/crack/rim.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <utility>

namespace cairn {

std::ptrdiff_t find_point(const std::vector<CrackPoint<3>>& points, const CrackPoint<3>& beside, std::int32_t index) {
  const auto wanted = std::tie(beside.crack, beside.image, index);
  const auto name = [](const CrackPoint<3>& p) { return std::tie(p.crack, p.image, p.index); };
  const auto at = std::lower_bound(points.begin(), points.end(), wanted,
                                   [&](const CrackPoint<3>& p, const auto& w) { return name(p) < w; });
  return at != points.end() && name(*at) == wanted ? at - points.begin() : -1;
}

void add_edges(const TriangleCorners& at, const std::array<Vec<3>, 3>& corners, const CrackTriangle& triangle,
               CrackEdge kind, std::vector<RimEdge>& edges) {
  const Vec<3> normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  for (int k = 0; k < 3; ++k) {
    if (triangle.edge(k) != kind) continue;
    const int next = (k + 1) % 3;
    edges.push_back({at[k], at[next], (corners[next] - corners[k]).cross(normal).normalized()});
  }
}

namespace {

/// The integral of q (1 . the direction out of the surface) along edges of the rim.
double weigh_rim(const CrackTip<3>& tip, const std::vector<CrackPoint<3>>& points, const std::vector<RimEdge>& edges,
                 double inner, double outer) {
  constexpr int samples = 8;  // of an edge
  double weight = 0;
  for (const RimEdge& edge : edges) {
    const Vec<3>&a = points[edge.a].plane, e = points[edge.b].plane - a;
    const double each = e.norm() / samples * edge.out.dot(tip.ahead);
    for (int s = 0; s < samples; ++s) weight += each * tip_weight<3>(tip, a + (s + 0.5) / samples * e, inner, outer);
  }
  return weight;
}

}  // namespace

std::vector<CrackTip<3>> rim_of_patch(const Patch<3>& patch, const CrackSegments<3>& triangles, double hat,
                                      double inner, double outer) {
  const auto& points = patch.cracks;
  std::vector<CrackTip<3>> tips;
  for (std::size_t first = 0, last = 0; first < points.size(); first = last) {
    while (last < points.size() && points[last].crack == points[first].crack) ++last;
    const auto ends_here = [](const CrackPoint<3>& p) { return p.own && p.tip; };
    if (std::none_of(points.begin() + first, points.begin() + last, ends_here)) continue;
    std::vector<RimEdge> edges;
    for_triangles(points, first, last, [&](const TriangleCorners& at, const CrackTriangle& triangle) {
      add_edges(at, {points[at[0]].plane, points[at[1]].plane, points[at[2]].plane}, triangle, CrackEdge::tip, edges);
    });
    for (std::size_t k = first; k < last; ++k) {
      if (!ends_here(points[k])) continue;
      Vec<3> along = Vec<3>::Zero();
      for (const RimEdge& edge : edges)
        if (std::cmp_equal(edge.a, k) || std::cmp_equal(edge.b, k))
          along += (points[edge.b].plane - points[edge.a].plane).normalized();
      CrackTip<3> tip;
      tip.crack = points[k].crack, tip.end = points[k].index, tip.position = points[k].plane, tip.hat = hat;
      tip.ahead = along.cross(triangles.normal_at(points[k])).normalized();
      tip.normal = tip.ahead.cross(along).normalized();
      tip.weight = weigh_rim(tip, points, edges, inner, outer);
      tips.push_back(tip);
    }
  }
  return tips;
}

}  // namespace cairn
