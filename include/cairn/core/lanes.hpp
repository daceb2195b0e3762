#pragma once
/// Eight doubles at a time (`Lanes`): the type in which points are processed, and the few functions that laws need on
/// it. Every function also takes plain doubles, so that a law is written once.

#include <bit>
#include <cmath>
#include <cstdint>

namespace cairn {

inline constexpr int lane_count = 8;
using Lanes = double __attribute__((vector_size(64)));
using LaneInts = std::int64_t __attribute__((vector_size(64)));
/// Four doubles: one vector quantity at a node, padded.
using Lanes4 = double __attribute__((vector_size(32)));

/// Loads and stores at 64-byte boundaries.
inline Lanes load(const double* p) {
  using Aliased = double __attribute__((vector_size(64), may_alias));
  return *reinterpret_cast<const Aliased*>(p);
}
inline void store(double* p, Lanes a) {
  using Aliased = double __attribute__((vector_size(64), may_alias));
  *reinterpret_cast<Aliased*>(p) = a;
}
inline Lanes4 load4(const double* p) {
  using Aliased = double __attribute__((vector_size(32), may_alias));
  return *reinterpret_cast<const Aliased*>(p);
}
inline void store4(double* p, Lanes4 a) {
  using Aliased = double __attribute__((vector_size(32), may_alias));
  *reinterpret_cast<Aliased*>(p) = a;
}
// a - 0 rather than a + 0, which is not a for -0 and costs an addition.
inline Lanes broadcast(double a) { return a - Lanes{}; }
inline Lanes4 broadcast4(double a) { return a - Lanes4{}; }

inline double select(bool c, double a, double b) { return c ? a : b; }
inline Lanes select(LaneInts c, Lanes a, Lanes b) { return c ? a : b; }
inline Lanes select(LaneInts c, Lanes a, double b) { return c ? a : broadcast(b); }

inline double square_root(double a) { return std::sqrt(a); }
inline Lanes square_root(Lanes a) {
  Lanes r;
  for (int i = 0; i < lane_count; ++i) r[i] = std::sqrt(a[i]);
  return r;
}

template <class T>
inline T maximum(T a, T b) {
  return select(a > b, a, b);
}

inline Lanes clamp(Lanes a, double low, double high) {
  a = select(a < low, broadcast(low), a);
  return select(a > high, broadcast(high), a);
}

inline double round_down(double a) { return std::floor(a); }
inline Lanes round_down(Lanes a) {
  Lanes r;
  for (int i = 0; i < lane_count; ++i) r[i] = std::floor(a[i]);
  return r;
}

inline Lanes absolute(Lanes a) { return select(a < 0.0, -a, a); }
inline double absolute(double a) { return std::abs(a); }

/// a^(-1/3) for a > 0, to round-off: an estimate from the exponent bits, refined by Newton's iteration.
inline Lanes inverse_cube_root(Lanes a) {
  const Lanes bits = __builtin_convertvector(std::bit_cast<LaneInts>(a), Lanes);
  const double origin = 4.0 / 3.0 * 1022.955 * 4503599627370496.0;
  auto y = std::bit_cast<Lanes>(__builtin_convertvector(origin - bits * (1.0 / 3.0), LaneInts));
  for (int i = 0; i < 5; ++i) y = y * (4.0 - a * (y * y * y)) * (1.0 / 3.0);
  return y;
}
inline double inverse_cube_root(double a) { return inverse_cube_root(broadcast(a))[0]; }

}  // namespace cairn
