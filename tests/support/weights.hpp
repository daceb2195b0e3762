#pragma once
/// Weights of nodes written from the literature, one node and one direction at a time; lengths in cells.
/// `x` is the point's position relative to the node.

#include <cmath>

namespace cairn::test {

struct Weight {
  double value, slope;
};

inline double sign(double x) { return x < 0 ? -1.0 : 1.0; }

/// Linear hat.
inline Weight hat(double x) {
  const double r = std::abs(x);
  if (r >= 1) return {0, 0};
  return {1 - r, -sign(x)};
}

/// GIMP with a point of half size l (Bardenhagen & Kober 2004; piecewise as in Steffen, Kirby & Berzins 2008).
inline Weight gimp(double x, double l) {
  const double r = std::abs(x);
  if (r < l) return {1 - (r * r + l * l) / (2 * l), -x / l};
  if (r < 1 - l) return {1 - r, -sign(x)};
  if (r < 1 + l) return {(1 + l - r) * (1 + l - r) / (4 * l), -sign(x) * (1 + l - r) / (2 * l)};
  return {0, 0};
}

/// Quadratic B-spline.
inline Weight spline(double x) {
  const double r = std::abs(x);
  if (r < 0.5) return {0.75 - x * x, -2 * x};
  if (r < 1.5) return {0.5 * (1.5 - r) * (1.5 - r), -sign(x) * (1.5 - r)};
  return {0, 0};
}

/// Bardenhagen, Brackbill & Sulsky 2000, eq. 24, along one direction: the densities of the cells on both sides of the
/// node, averaged (value) and differenced, with the sign that points out of the body (slope).
inline Weight cell_density(double x) {
  const double right = spline(x - 0.5).value, left = spline(x + 0.5).value;
  return {0.5 * (left + right), left - right};
}

}  // namespace cairn::test
