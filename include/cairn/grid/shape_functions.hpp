#pragma once
/// Shape functions as tensor products of one-dimensional weights. Each is a small struct that evaluates, for eight
/// points at once, the values and slopes at its `nodes` consecutive nodes along one direction. Lengths in cells.

#include <type_traits>

#include "cairn/core/lanes.hpp"
#include "cairn/grid/lattice.hpp"

namespace cairn {

/// Linear hat functions: Bardenhagen, Brackbill & Sulsky 2000, section 2 ("linear b-splines").
struct LinearShape {
  static constexpr int nodes = 2;
  template <class T>
  static T first_node(T xi) {
    return round_down(xi);
  }
  void evaluate(int /*d*/, Lanes xi, Lanes first, Lanes* value, Lanes* slope) const {
    const Lanes f = xi - first;
    value[0] = 1.0 - f, value[1] = f;
    slope[0] = broadcast(-1.0), slope[1] = broadcast(1.0);
  }
};

/// Quadratic B-spline.
struct QuadraticShape {
  static constexpr int nodes = 3;
  template <class T>
  static T first_node(T xi) {
    return round_down(xi + 0.5) - 1.0;
  }
  void evaluate(int /*d*/, Lanes xi, Lanes first, Lanes* value, Lanes* slope) const {
    const Lanes d = xi - first - 1.0;  // from the middle node, -1/2 to 1/2
    value[0] = 0.5 * (0.5 - d) * (0.5 - d), value[1] = 0.75 - d * d, value[2] = 0.5 * (0.5 + d) * (0.5 + d);
    slope[0] = d - 0.5, slope[1] = -2.0 * d, slope[2] = d + 0.5;
  }
};

/// Generalised interpolation (Bardenhagen & Kober 2004): the hat function averaged over a point's own extent, which
/// keeps its initial size ("uGIMP"). `half[d]` is half that extent, at most 1/2.
struct GimpShape {
  static constexpr int nodes = 3;
  std::array<double, 3> half;
  template <class T>
  static T first_node(T xi) {
    return round_down(xi + 0.5) - 1.0;
  }
  void evaluate(int d, Lanes xi, Lanes first, Lanes* value, Lanes* slope) const {
    const double l = half[d], scale = 0.5 / l;
    for (int k = 0; k < nodes; ++k) {
      const Lanes r = xi - first - static_cast<double>(k);
      const Lanes a = clamp(r - l), b = clamp(r + l);
      const Lanes absolute_a = absolute(a), absolute_b = absolute(b);
      // The hat's integral is 1/2 + u - u|u|/2 on [-1, 1].
      value[k] = scale * ((b - 0.5 * b * absolute_b) - (a - 0.5 * a * absolute_a));
      slope[k] = scale * (absolute_a - absolute_b);
    }
  }

 private:
  static Lanes clamp(Lanes u) {
    u = select(u > 1.0, Lanes{} + 1.0, u);
    return select(u < -1.0, Lanes{} - 1.0, u);
  }
};

/// Not an interpolation, but the weights of the density gradient of Bardenhagen, Brackbill & Sulsky 2000, eq. 24:
/// density at cell centres by quadratic B-splines, its gradient at the nodes by differences. `slope` is minus that
/// difference (so that sums of it point outwards like the other gradients) and `value` the mean of the two cells.
struct CellDensityShape {
  static constexpr int nodes = 4;
  template <class T>
  static T first_node(T xi) {
    return round_down(xi) - 1.0;
  }
  void evaluate(int /*d*/, Lanes xi, Lanes first, Lanes* value, Lanes* slope) const {
    for (int k = 0; k < nodes; ++k) {
      const Lanes r = xi - first - static_cast<double>(k);
      const Lanes a = spline(r + 0.5), b = spline(r - 0.5);
      value[k] = 0.5 * (a + b), slope[k] = a - b;
    }
  }

 private:
  static Lanes spline(Lanes u) {
    u = absolute(u);
    const Lanes outer = select(u < 1.5, 0.5 * (1.5 - u) * (1.5 - u), 0.0);
    return select(u < 0.5, 0.75 - u * u, outer);
  }
};

/// A shape function of points that carry spin: stencils also hold the arms from a point to its nodes.
template <class Shape>
struct Spinning : Shape {
  static constexpr bool spinning = true;
};

/// Weights of eight points on the nodes of a box.
template <int Dim, class Shape>
struct Stencil {
  static constexpr int n = Shape::nodes;
  static constexpr bool spinning = requires { Shape::spinning; };
  alignas(64) double value[Dim][n][lane_count];
  alignas(64) double slope[Dim][n][lane_count];  // [1/m]
  alignas(64) double first[lane_count];          // offset of the first node in the box
  // With spin: node minus point [m], and sum N arm^2 [m2], along each direction.
  alignas(64) double arm[spinning ? Dim : 1][n][lane_count];
  alignas(64) double spread[spinning ? Dim : 1][lane_count];
  int stride[3];
  double inverse_spacing[Dim];  // [1/m]

  /// `x[d]` points to the positions along d [m], on a 64-byte boundary.
  Stencil(const Lattice<Dim>& lattice, const Shape& shape, const Box<Dim>& box, const double* const (&x)[Dim]) {
    Lanes offset{};
    for (int d = 0; d < Dim; ++d) {
      stride[d] = box.stride(d), inverse_spacing[d] = lattice.inverse_spacing()[d];
      const Lanes xi = (load(x[d]) - lattice.lower()[d]) * lattice.inverse_spacing()[d];
      const Lanes start = Shape::first_node(xi);
      Lanes v[n], s[n];
      shape.evaluate(d, xi, start, v, s);
      for (int k = 0; k < n; ++k) {
        store(value[d][k], v[k]);
        store(slope[d][k], s[k] * lattice.inverse_spacing()[d]);
      }
      if constexpr (spinning) {
        Lanes sum{};
        for (int k = 0; k < n; ++k) {
          const Lanes a = (start + static_cast<double>(k) - xi) * lattice.spacing()[d];
          sum += v[k] * a * a;
          store(arm[d][k], a);
        }
        store(spread[d], sum);
      }
      offset += (start - static_cast<double>(box.lower[d])) * static_cast<double>(stride[d]);
    }
    store(first, offset);
  }

  /// Calls f(offset, weight, gradient[Dim]), or f(offset, weight, gradient[Dim], arm[Dim]), for every node of the point
  /// in `lane`.
  template <class F>
  void for_nodes(int lane, F&& f) const {
    const int origin = static_cast<int>(first[lane]);
    if constexpr (Dim == 2) {
#pragma GCC unroll 4
      for (int j = 0; j < n; ++j) {
        const double vy = value[1][j][lane], sy = slope[1][j][lane];
#pragma GCC unroll 4
        for (int i = 0; i < n; ++i) {
          const double vx = value[0][i][lane];
          const double gradient[2] = {slope[0][i][lane] * vy, vx * sy};
          call(f, origin + j * stride[1] + i, vx * vy, gradient, lane, {i, j});
        }
      }
    } else {
#pragma GCC unroll 4
      for (int k = 0; k < n; ++k) {
        const double vz = value[2][k][lane], sz = slope[2][k][lane];
#pragma GCC unroll 4
        for (int j = 0; j < n; ++j) {
          const double vy = value[1][j][lane];
          const double vyz = vy * vz, syz = slope[1][j][lane] * vz, vsz = vy * sz;
#pragma GCC unroll 4
          for (int i = 0; i < n; ++i) {
            const double vx = value[0][i][lane];
            const double gradient[3] = {slope[0][i][lane] * vyz, vx * syz, vx * vsz};
            call(f, origin + k * stride[2] + j * stride[1] + i, vx * vyz, gradient, lane, {i, j, k});
          }
        }
      }
    }
  }

 private:
  template <class F>
  void call(F& f, int node, double weight, const double (&gradient)[Dim], int lane, const Index<Dim>& at) const {
    if constexpr (std::is_invocable_v<F&, int, double, const double(&)[Dim], const double(&)[Dim]>) {
      double arms[Dim];
      for (int d = 0; d < Dim; ++d) arms[d] = arm[d][at[d]][lane];
      f(node, weight, gradient, arms);
    } else {
      f(node, weight, gradient);
    }
  }
};

}  // namespace cairn
