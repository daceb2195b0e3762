// Compiled without contraction of a * b + c, on which the error bounds below rely.

#include "cairn/crack/crossing.hpp"

#include "exact_sum.hpp"

namespace cairn::crack {

int orientation(const Vec<2>& a, const Vec<2>& b, const Vec<2>& c) {
  const double left = (a.x() - c.x()) * (b.y() - c.y()), right = (a.y() - c.y()) * (b.x() - c.x());
  const double det = left - right;
  constexpr double bound = 4.44089209850062616169452667236328125e-16;  // Shewchuk's (3 + 16 u) u, rounded up
  if (std::abs(det) > bound * (std::abs(left) + std::abs(right))) return sign_of(det);
  ExactSum<12> exact;
  exact.add_product(a.x(), b.y(), 1), exact.add_product(a.y(), b.x(), -1);
  exact.add_product(b.x(), c.y(), 1), exact.add_product(b.y(), c.x(), -1);
  exact.add_product(c.x(), a.y(), 1), exact.add_product(c.y(), a.x(), -1);
  return exact.sign();
}

int side_of_line(const Vec<2>& p, const Vec<2>& i, const Vec<2>& c) {
  const int exact = orientation(p, i, c);
  if (exact != 0) return exact;
  // The derivatives to the node's x and y, then to the point's.
  return first_sign(difference(c.y(), p.y()), difference(p.x(), c.x()), difference(i.y(), c.y()),
                    difference(c.x(), i.x()));
}

int side_of_segment(const Vec<2>& a, const Vec<2>& b, const Vec<2>& q) {
  const int exact = orientation(a, b, q);
  return exact != 0 ? exact : first_sign(difference(a.y(), b.y()), difference(b.x(), a.x()));
}

int crossing(const Vec<2>& p, const Vec<2>& i, const Vec<2>& a, const Vec<2>& b) {
  const int from = side_of_segment(a, b, p), to = side_of_segment(a, b, i);
  if (from == to || side_of_line(p, i, a) == side_of_line(p, i, b)) return 0;
  return from;
}

}  // namespace cairn::crack
