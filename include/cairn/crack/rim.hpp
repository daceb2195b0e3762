#pragma once
/// The triangles that a patch knows of a crack in 3D, and the edges of its rim.

#include <vector>

#include "cairn/crack/j_integral.hpp"
#include "cairn/crack/sides.hpp"

namespace cairn {

/// Places of a triangle's corners in the list of a patch's crack points.
using TriangleCorners = std::array<std::ptrdiff_t, 3>;

/// An edge of a crack's rim, with the surface on its left, and the direction that leads out of it there.
struct RimEdge {
  std::ptrdiff_t a, b;  // places in the list of crack points
  Vec<3> out;           // unit, in the plane of the triangle
};

/// The place of the point of that index on the crack of `beside`; -1 where the patch does not know it.
std::ptrdiff_t find_point(const std::vector<CrackPoint<3>>& points, const CrackPoint<3>& beside, std::int32_t index);

/// Calls f(corners, triangle) for the triangles of points [first, last) of which all corners are known.
template <class F>
void for_triangles(const std::vector<CrackPoint<3>>& points, std::size_t first, std::size_t last, F&& f) {
  for (std::size_t k = first; k < last; ++k)
    for (std::int32_t t = 0; t < points[k].held; ++t) {
      const CrackTriangle& triangle = points[k].triangles[t];
      const TriangleCorners at = {static_cast<std::ptrdiff_t>(k), find_point(points, points[k], triangle.second),
                                  find_point(points, points[k], triangle.third)};
      if (at[1] >= 0 && at[2] >= 0) f(at, triangle);
    }
}

/// Appends the edges of a triangle that are of a kind.
void add_edges(const TriangleCorners& at, const std::array<Vec<3>, 3>& corners, const CrackTriangle& triangle,
               CrackEdge kind, std::vector<RimEdge>& edges);

/// The patch's own points of cracks' rims inside bodies, ascending in (crack, index), with their axes and the integral
/// of q along the rim. \param hat, inner, outer  of q [m]
std::vector<CrackTip<3>> rim_of_patch(const Patch<3>& patch, const CrackSegments<3>& triangles, double hat,
                                      double inner, double outer);

}  // namespace cairn
