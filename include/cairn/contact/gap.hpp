#pragma once
/// The gap between bodies at a node, from the volume and the gradient of volume that each has there.
///
/// A flat layer that covers the interval from s to s + t cells off the node has, under linear hats (to which GIMP's
/// sums over points without gaps amount), the volume v and the gradient g,
///   beside the node (0 <= s, s + t <= 1):      v = t (1 - s - t/2),                     g = t
///   over it (from -a to b, 0 <= a <= b <= 1):  v = a + b - (a^2 + b^2)/2,               g = b - a
/// in shares of the node's room; where the layer ends beyond the hat, s + t or b is 1. Both are solved for the place of
/// the near surface, s or -a, whatever the thickness: volume alone cannot tell a thin layer that touches from a thick
/// one that is far.

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn::contact {

/// Distance [cells] from a node to the near surface of a body with the volume v > 0 there and a gradient of size g, in
/// shares of the node's room; negative where the body covers the node. Exact for layers that lie along the grid.
inline double distance_to_surface(double v, double g) {
  if (v <= g * (1 - g / 2)) return 1 - g / 2 - v / g;
  const double thickness = 2 * (1 - std::sqrt(std::max(0.0, 1 - v - g * g / 4)));  // a + b
  return -std::max(0.0, thickness - g) / 2;
}

/// Largest gap [cells] at which bodies touch: what leaves the share `fill` of a node on one of their surfaces filled.
/// None for 0: they touch wherever they share a node.
inline double largest_gap(double fill) {
  if (!(fill > 0)) return std::numeric_limits<double>::infinity();
  return 1 - std::sqrt(std::max(0.0, 2 * fill - 1));
}

/// The same at a wall, where half of a node's room is there to be filled.
inline double largest_gap_at_wall(double fill) {
  return fill > 0 ? 1 - std::sqrt(fill) : std::numeric_limits<double>::infinity();
}

}  // namespace cairn::contact
