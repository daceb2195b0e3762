#pragma once
/// The gap between bodies at a node, from the volume and the gradient of volume that each has there, and the gap at
/// which they count as touching.
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

#include "cairn/core/options.hpp"

namespace cairn::contact {

/// Distance [cells] from a node to the near surface of a body with the volume v > 0 there and a gradient of size g, in
/// shares of the node's room; negative where the body covers the node. Exact for layers that lie along the grid.
inline double distance_to_surface(double v, double g) {
  if (v <= g * (1 - g / 2)) return 1 - g / 2 - v / g;
  const double thickness = 2 * (1 - std::sqrt(std::max(0.0, 1 - v - g * g / 4)));  // a + b
  return -std::max(0.0, thickness - g) / 2;
}

/// Along a given normal, for a body that may end beside the node: `along` and `across` are the sizes of its gradient's
/// parts. What a straight edge leaves of the hat, the share c, has across/v = (1 - |x|)/c with x the edge's place, and
/// a layer of volume v/c and gradient along/c would fill the node if it went on.
inline double distance_beside_edge(double v, double along, double across) {
  const double r = across / v;
  double c = 1;
  if (r >= 2) {
    c = 2 / (r * r);
  } else if (r > 1e-6) {
    const double u = (std::sqrt(1 + 2 * r * r) - 1) / r;
    c = 1 - u * u / 2;
  }
  // No less than the least share with which v and `along` belong to a layer.
  const double least = v <= along * (1 - along / 2) ? along * along / (2 * v) : 0.0;
  c = std::min(1.0, std::max({c, least, 0.5 * (v + std::sqrt(v * v + 2 * along * along))}));
  return distance_to_surface(v / c, along / c);
}

/// Gaps [cells] at which bodies touch: up to `least` in any case, up to `most` where forces press them.
///
/// What nothing presses touches at its true surface. What is pressed is strained, and its points do not show the
/// surface to better than that strain: held only at its measured surface it would chatter. The gap that a normal force
/// F closes in the time tau = 4 h/c that a wave needs for four cells, F tau^2/2m for each of the two bodies, is a fixed
/// multiple of that strain, whatever the time step.
struct TouchingGap {
  double least = 0, most = 0;

  /// Share of the gap that a unit of force allows a body of mass m at the node and wave speed c [1/N].
  static double yield(double spacing, double wave_speed, double mass) {
    constexpr double cells = 4;
    return wave_speed > 0 ? cells * cells * spacing / (2 * wave_speed * wave_speed * mass) : 0.0;
  }
  /// \param by_force sum of F yield over the two bodies [cells]
  bool touches(double gap, double by_force) const { return gap <= std::clamp(by_force, least, most); }

  /// An explicit stand-off leaves the share `fill` of a node on one of the surfaces filled; 0: wherever a node is
  /// shared. At a wall half of the node's room is there to be filled.
  static TouchingGap make(const ContactOptions& options, bool at_wall) {
    if (options.gap == GapRule::pressure) return {0.03, 0.23};
    if (!(options.fill > 0)) return {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    const double gap = 1 - std::sqrt(at_wall ? options.fill : std::max(0.0, 2 * options.fill - 1));
    return {gap, gap};
  }
};

}  // namespace cairn::contact
