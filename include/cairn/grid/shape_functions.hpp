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

/// The nodes that shapes of up to three of them take: the nearest and its neighbours.
struct NodesOfGimp {
  static constexpr int nodes = 3;
  template <class T>
  static T first_node(T xi) {
    return round_down(xi + 0.5) - 1.0;
  }
};

/// Quadratic B-spline.
struct QuadraticShape : NodesOfGimp {
  void evaluate(int /*d*/, Lanes xi, Lanes first, Lanes* value, Lanes* slope) const {
    const Lanes d = xi - first - 1.0;  // from the middle node, -1/2 to 1/2
    value[0] = 0.5 * (0.5 - d) * (0.5 - d), value[1] = 0.75 - d * d, value[2] = 0.5 * (0.5 + d) * (0.5 + d);
    slope[0] = d - 0.5, slope[1] = -2.0 * d, slope[2] = d + 0.5;
  }
};

/// Generalised interpolation (Bardenhagen & Kober 2004): the hat function averaged over a point's own extent, which
/// keeps its initial size ("uGIMP"). `half[d]` is half that extent, at most 1/2.
struct GimpShape : NodesOfGimp {
  std::array<double, 3> half;
  explicit GimpShape(const std::array<double, 3>& half_) : half(half_) {}
  void evaluate(int d, Lanes xi, Lanes first, Lanes* value, Lanes* slope) const {
    const double l = half[d], scale = 0.5 / l;
    for (int k = 0; k < nodes; ++k) {
      const Lanes r = xi - first - static_cast<double>(k);
      const Lanes a = clamp(r - l, -1.0, 1.0), b = clamp(r + l, -1.0, 1.0);
      const Lanes absolute_a = absolute(a), absolute_b = absolute(b);
      // The hat's integral is 1/2 + u - u|u|/2 on [-1, 1].
      value[k] = scale * ((b - 0.5 * b * absolute_b) - (a - 0.5 * a * absolute_a));
      slope[k] = scale * (absolute_a - absolute_b);
    }
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

/// What the weights of a row of nodes along x have in common: products over the other directions.
template <int Dim>
struct RowWeights {
  double value;
  double slope[Dim];  // with the slope in place of the value along direction d > 0 [1/m]
  double arm[Dim];    // node minus point along direction d > 0 [m], with spin
};

/// The factors of one point's weights along x.
template <int n>
struct AlongX {
  double value[n];
  double slope[n];  // [1/m]
  double lever[n];  // value times node minus point [m], with spin
};

/// Weights of eight points on the nodes of a box. They are products, so that sums over the nodes of a point are done
/// row by row: along x first, then times what the row has in common.
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

  /// `x[d]` points to the positions along d [m], on a 64-byte boundary. The box holds all nodes of the points.
  ///
  /// A point within a rounding error of where a shape function takes up the next node may do so or not, with the same
  /// weights. The compiler chooses how an expression is rounded at every place anew, so that whoever made the box may
  /// have chosen the other way: a node taken here lies in the box in any case.
  Stencil(const Lattice<Dim>& lattice, const Shape& shape, const Box<Dim>& box, const double* const (&x)[Dim],
          int /*point*/ = 0) {
    Lanes offset{};
    for (int d = 0; d < Dim; ++d) {
      stride[d] = box.stride(d), inverse_spacing[d] = lattice.inverse_spacing()[d];
      const Lanes xi = (load(x[d]) - lattice.lower()[d]) * lattice.inverse_spacing()[d];
      const Lanes start = clamp(Shape::first_node(xi), box.lower[d], box.upper[d] - n);
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

  AlongX<n> along_x(int lane) const {
    AlongX<n> x;
    for (int i = 0; i < n; ++i) {
      x.value[i] = value[0][i][lane], x.slope[i] = slope[0][i][lane];
      if constexpr (spinning) x.lever[i] = value[0][i][lane] * arm[0][i][lane];
    }
    return x;
  }

  /// Calls f(offset of the first node, weights) for every row along x of the nodes of the point in `lane`.
  template <class F>
  void for_rows(int lane, F&& f) const {
    const int origin = static_cast<int>(first[lane]);
    const auto arm_of = [&](int d, int k) { return spinning ? arm[spinning ? d : 0][k][lane] : 0.0; };
    if constexpr (Dim == 2) {
#pragma GCC unroll 4
      for (int j = 0; j < n; ++j)
        f(origin + j * stride[1], RowWeights<2>{value[1][j][lane], {0, slope[1][j][lane]}, {0, arm_of(1, j)}});
    } else {
#pragma GCC unroll 4
      for (int k = 0; k < n; ++k) {
        const double vz = value[2][k][lane], sz = slope[2][k][lane];
#pragma GCC unroll 4
        for (int j = 0; j < n; ++j) {
          const double vy = value[1][j][lane];
          f(origin + k * stride[2] + j * stride[1],
            RowWeights<3>{vy * vz, {0, slope[1][j][lane] * vz, vy * sz}, {0, arm_of(1, j), arm_of(2, k)}});
        }
      }
    }
  }

  /// Calls f(offset, weight, gradient[Dim]) for every node of the point in `lane`.
  template <class F>
  void for_nodes(int lane, F&& f) const {
    const auto x = along_x(lane);
    for_rows(lane, [&](int node, const RowWeights<Dim>& row) {
      for (int i = 0; i < n; ++i) {
        double gradient[Dim] = {x.slope[i] * row.value};
        for (int d = 1; d < Dim; ++d) gradient[d] = x.value[i] * row.slope[d];
        f(node + i, x.value[i] * row.value, gradient);
      }
    });
  }
};

}  // namespace cairn
