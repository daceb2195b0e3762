// Compiled without contraction of a * b + c, on which the error bounds below rely.

#include <Eigen/Dense>

#include "cairn/crack/crossing.hpp"
#include "exact_sum.hpp"

namespace cairn::crack {
namespace {

/// The sign of component k of (b - a) x (c - a), exact.
int sign_of_normal(int k, const Vec<3>& a, const Vec<3>& b, const Vec<3>& c) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  return orientation(Vec<2>(a[i], a[j]), Vec<2>(b[i], b[j]), Vec<2>(c[i], c[j]));
}

/// Adds the determinant of a, b, c as rows.
template <int Most>
void add_determinant(ExactSum<Most>& sum, const Vec<3>& a, const Vec<3>& b, const Vec<3>& c, double sign) {
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    sum.add_product(a[k], b[i], c[j], sign), sum.add_product(a[k], b[j], c[i], -sign);
  }
}

/// Whether a - b, which rounds to x, is x.
bool is_difference(double a, double b, double x) {
  const double virtual_b = a - x, virtual_a = x + virtual_b;
  return (a - virtual_a) + (virtual_b - b) == 0;
}
bool is_difference(const Vec<3>& a, const Vec<3>& b, const Vec<3>& x) {
  return is_difference(a[0], b[0], x[0]) && is_difference(a[1], b[1], x[1]) && is_difference(a[2], b[2], x[2]);
}

}  // namespace

int orientation(const Vec<3>& a, const Vec<3>& b, const Vec<3>& c, const Vec<3>& d) {
  const Vec<3> u = b - a, v = c - a, w = d - a;
  double det = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double left = u[i] * v[j], right = u[j] * v[i];
    det += w[k] * (left - right), size += std::abs(w[k]) * (std::abs(left) + std::abs(right));
  }
  constexpr double bound = 1e-15;  // Shewchuk's (7 + 56 u) u is 7.8e-16; here two additions more
  if (std::abs(det) > bound * size) return sign_of(det);
  if (is_difference(b, a, u) && is_difference(c, a, v) && is_difference(d, a, w)) {  // as on grids
    ExactSum<24> exact;
    add_determinant(exact, u, v, w, 1);
    return exact.sign();
  }
  ExactSum<96> exact;
  add_determinant(exact, b, c, d, 1), add_determinant(exact, a, c, d, -1);
  add_determinant(exact, a, b, d, 1), add_determinant(exact, a, b, c, -1);
  return exact.sign();
}

int side_of_line(const Vec<3>& p, const Vec<3>& i, const Vec<3>& a, const Vec<3>& b) {
  if (const int exact = orientation(p, i, a, b)) return exact;
  // The derivatives to the node's x, y and z, (a - p) x (b - p), then to the point's, -(a - i) x (b - i).
  for (int k = 0; k < 3; ++k)
    if (const int sign = sign_of_normal(k, p, a, b)) return sign;
  for (int k = 0; k < 3; ++k)
    if (const int sign = sign_of_normal(k, i, a, b)) return -sign;
  // The line lies along the edge: to the node's x and the point's y or z, then to the node's y and the point's z.
  return first_sign(difference(a.z(), b.z()), difference(b.y(), a.y()), difference(a.x(), b.x()));
}

int side_of_triangle(const std::array<Vec<3>, 3>& corners, const Vec<3>& q) {
  const auto& [a, b, c] = corners;
  if (const int exact = orientation(a, b, c, q)) return exact;
  for (int k = 0; k < 3; ++k)
    if (const int sign = sign_of_normal(k, a, b, c)) return sign;
  return 0;
}

int crossing(const Vec<3>& p, const Vec<3>& i, const std::array<Vec<3>, 3>& corners) {
  const int from = side_of_triangle(corners, p), to = side_of_triangle(corners, i);
  if (from == to) return 0;
  const auto& [a, b, c] = corners;
  const int side = side_of_line(p, i, a, b);
  return side == side_of_line(p, i, b, c) && side == side_of_line(p, i, c, a) ? from : 0;
}

}  // namespace cairn::crack
