#include "sheets.hpp"

#include <Eigen/Dense>

#include "cairn/crack/rim.hpp"

namespace cairn {
namespace {

using Triangle = CrackSegments<3>::Segment;

void add(int crack, const std::array<Vec<3>, 3>& corners, std::vector<Triangle>& triangles) {
  const Vec<3> across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  if (across.squaredNorm() > 0) triangles.push_back({crack, corners, across.normalized()});
}

/// What lies beyond an open rim: a strip along its edges, without gaps at their corners.
void add_strip(const std::vector<CrackPoint<3>>& points, const std::vector<RimEdge>& edges, double beyond,
               std::vector<Triangle>& triangles) {
  struct Outward {
    Vec<3> sum = Vec<3>::Zero();
    double count = 0;
  };
  std::map<std::ptrdiff_t, Outward> outward;
  for (const RimEdge& edge : edges)
    for (const auto end : {edge.a, edge.b}) outward[end].sum += edge.out, ++outward[end].count;
  const auto further = [&](std::ptrdiff_t end) -> Vec<3> {
    // The sum of two units, over 1 + their product, lies a unit beyond both edges.
    const auto& [sum, count] = outward.at(end);
    const double squared = sum.squaredNorm();
    return points[end].plane + beyond * sum * (count > 1 ? 2 / std::max(1.0, squared) : 1.0);
  };
  for (const RimEdge& edge : edges) {
    const Vec<3>&a = points[edge.a].plane, b = points[edge.b].plane, c = further(edge.b), d = further(edge.a);
    add(points[edge.a].crack, {b, a, d}, triangles), add(points[edge.a].crack, {b, d, c}, triangles);
  }
}

}  // namespace

void list_triangles(const Patch<3>& patch, double beyond, const std::vector<Crack>& cracks,
                    std::vector<Triangle>& triangles, std::vector<CrackSegments<3>::PointNormal>& normals) {
  const auto& points = patch.cracks;
  for (const auto& point : points) normals.push_back({point.crack, point.image, point.index, Vec<3>::Zero()});
  for (std::size_t first = 0, last = 0; first < points.size(); first = last) {
    while (last < points.size() && points[last].crack == points[first].crack) ++last;
    if (cracks[points[first].crack].idle) continue;
    std::vector<RimEdge> open;
    for_triangles(points, first, last, [&](const TriangleCorners& at, const CrackTriangle& triangle) {
      const std::array<Vec<3>, 3> x = {points[at[0]].plane, points[at[1]].plane, points[at[2]].plane};
      add(points[first].crack, x, triangles);
      const Vec<3> across = (x[1] - x[0]).cross(x[2] - x[0]);
      for (const auto corner : at) normals[corner].normal += across;
      add_edges(at, x, triangle, CrackEdge::open, open);
    });
    add_strip(points, open, beyond, triangles);
  }
  for (auto& point : normals) point.normal = point.normal.normalized().eval();
}

}  // namespace cairn
