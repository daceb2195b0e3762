#pragma once
/// Whether a straight line from a material point to a node crosses a segment (in 3D a triangle) of a crack, without
/// rounding errors and with one rule for ties: the node is thought moved by (e, e^2[, e^3]), e -> 0+, then the point by
/// smaller powers of e. So no node lies on a crack, no crack point on a line, and a line through a crack point crosses
/// exactly one of its two segments; one through an edge or a corner of a surface, one of the triangles there.

#include <array>

#include "cairn/core/types.hpp"

namespace cairn::crack {

/// The sign of (b - a) x (c - a), exact: 1 where c lies left of the line from a to b, 0 on it.
int orientation(const Vec<2>& a, const Vec<2>& b, const Vec<2>& c);

/// The side of the line from the point p to the node i on which the crack point c lies: 1 left, -1 right.
int side_of_line(const Vec<2>& p, const Vec<2>& i, const Vec<2>& c);

/// The side of the segment from a to b on which a node or point q lies: 1 left (above), -1 right (below).
int side_of_segment(const Vec<2>& a, const Vec<2>& b, const Vec<2>& q);

/// Whether the line from p to i crosses the segment from a to b: 1 from above to below, -1 from below to above, 0 not.
int crossing(const Vec<2>& p, const Vec<2>& i, const Vec<2>& a, const Vec<2>& b);
inline int crossing(const Vec<2>& p, const Vec<2>& i, const std::array<Vec<2>, 2>& corners) {
  return crossing(p, i, corners[0], corners[1]);
}

/// The sign of (b - a) x (c - a) . (d - a), exact: 1 where d lies on the side of the plane through a, b, c from which
/// they go round to the left, 0 on it.
int orientation(const Vec<3>& a, const Vec<3>& b, const Vec<3>& c, const Vec<3>& d);

/// On which side of it the line from the point p to the node i passes the edge from a to b: the sign of the volume of
/// p, i, a, b. That of the edge from b to a is the opposite.
int side_of_line(const Vec<3>& p, const Vec<3>& i, const Vec<3>& a, const Vec<3>& b);

/// The side of the triangle's plane on which a node or point q lies: 1 above, -1 below.
int side_of_triangle(const std::array<Vec<3>, 3>& corners, const Vec<3>& q);

/// Whether the line from p to i crosses the triangle: 1 from above to below, -1 from below to above, 0 not.
int crossing(const Vec<3>& p, const Vec<3>& i, const std::array<Vec<3>, 3>& corners);

}  // namespace cairn::crack
