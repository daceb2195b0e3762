#pragma once
/// Boxes of lattice positions (cells or nodes), half open: lower <= i < upper.

#include <algorithm>
#include <cstddef>

#include "cairn/core/types.hpp"

namespace cairn {

template <int Dim>
struct Box {
  Index<Dim> lower{}, upper{};

  int extent(int d) const { return upper[d] - lower[d]; }
  bool empty() const {
    for (int d = 0; d < Dim; ++d)
      if (upper[d] <= lower[d]) return true;
    return false;
  }
  std::size_t size() const {
    std::size_t n = 1;
    for (int d = 0; d < Dim; ++d) n *= static_cast<std::size_t>(std::max(0, extent(d)));
    return n;
  }
  /// Distance in memory between neighbours along `d`; x runs fastest.
  int stride(int d) const {
    int s = 1;
    for (int e = 0; e < d; ++e) s *= extent(e);
    return s;
  }
  int offset(const Index<Dim>& i) const {
    int o = 0;
    for (int d = Dim - 1; d >= 0; --d) o = o * extent(d) + (i[d] - lower[d]);
    return o;
  }
  /// The position with an offset.
  Index<Dim> place(int offset) const {
    Index<Dim> i;
    for (int d = 0; d < Dim; offset /= extent(d), ++d) i[d] = lower[d] + offset % extent(d);
    return i;
  }
  bool contains(const Index<Dim>& i) const {
    for (int d = 0; d < Dim; ++d)
      if (i[d] < lower[d] || i[d] >= upper[d]) return false;
    return true;
  }
  bool contains(const Box& other) const {
    for (int d = 0; d < Dim; ++d)
      if (other.lower[d] < lower[d] || other.upper[d] > upper[d]) return false;
    return true;
  }
  Box shifted(const Index<Dim>& by) const {
    Box b = *this;
    for (int d = 0; d < Dim; ++d) b.lower[d] += by[d], b.upper[d] += by[d];
    return b;
  }
  friend bool operator==(const Box&, const Box&) = default;
};

template <int Dim>
Box<Dim> intersection(const Box<Dim>& a, const Box<Dim>& b) {
  Box<Dim> r;
  for (int d = 0; d < Dim; ++d)
    r.lower[d] = std::max(a.lower[d], b.lower[d]), r.upper[d] = std::min(a.upper[d], b.upper[d]);
  return r;
}

/// Smallest box that holds both; an empty box adds nothing.
template <int Dim>
Box<Dim> hull(const Box<Dim>& a, const Box<Dim>& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  Box<Dim> r;
  for (int d = 0; d < Dim; ++d)
    r.lower[d] = std::min(a.lower[d], b.lower[d]), r.upper[d] = std::max(a.upper[d], b.upper[d]);
  return r;
}

/// Calls f(position) for every position, x fastest.
template <int Dim, class F>
void for_each(const Box<Dim>& box, F&& f) {
  if (box.empty()) return;
  Index<Dim> i = box.lower;
  while (true) {
    f(i);
    int d = 0;
    while (d < Dim && ++i[d] == box.upper[d]) i[d] = box.lower[d], ++d;
    if (d == Dim) return;
  }
}

/// Calls f(offset in outer, number) for every row along x of `inner`, which lies within `outer`.
template <int Dim, class F>
void for_each_row(const Box<Dim>& inner, const Box<Dim>& outer, F&& f) {
  if (inner.empty()) return;
  Box<Dim> starts = inner;
  starts.upper[0] = starts.lower[0] + 1;
  for_each(starts, [&](const Index<Dim>& i) { f(outer.offset(i), inner.extent(0)); });
}

}  // namespace cairn
