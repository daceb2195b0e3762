#pragma once
/// CPDI: convected particle domain interpolation (Sadeghirad, Brannon & Burghardt, Int. J. Numer. Meth. Engng 86, 2011,
/// eqs. 16-19). A point stands for a parallelogram (2D) or parallelepiped (3D) that deforms with it. With half vectors
/// r_j from its middle to the middles of its faces, R = [r_1 .. r_Dim] and corners x_p + R s_c, s_cj = +-1,
///   N_ip = mean over corners of N_i(x_c),   grad N_ip = R^-T mean over corners of s_c N_i(x_c),
/// N_i the linear hats. The weights sum to 1 and reproduce linear fields whatever R is.

#include <concepts>

#include "cairn/grid/shape_functions.hpp"

namespace cairn {

/// Domains may reach half a cell from their points along each direction, so that a point sees GIMP's nodes.
struct CpdiShape : NodesOfGimp {
  // E = diag(1/h) R of the points of a piece: E_dj of all points in column d Dim + j. Columns begin `stride` doubles
  // apart, on 64-byte boundaries.
  const double* domains = nullptr;
  std::ptrdiff_t stride = 0;
};

/// What a point gives to and takes from one node.
template <int Dim>
struct NodeWeights {
  double value;
  double volume;      // in place of `value` in sums of volume
  double slope[Dim];  // [1/m]
  double arm[Dim];    // node minus point [m], with spin
};

/// Weights of eight points that are no products. Sums of volume take Simpson's rule over the domain, 2/3 N_i(x_p) + 1/3
/// N_ip: from them follows the gap between flat layers (contact/gap.hpp), which the corners alone would blur.
template <int Dim, class Shape>
requires std::derived_from<Shape, CpdiShape>
struct Stencil<Dim, Shape> {
  static constexpr int n = Shape::nodes, all = Dim == 2 ? n * n : n * n * n, corners = 1 << Dim;
  static constexpr bool spinning = requires { Shape::spinning; };
  alignas(64) double value[all][lane_count];
  alignas(64) double volume[all][lane_count];
  alignas(64) double slope[Dim][all][lane_count];  // [1/m]
  alignas(64) double first[lane_count];            // offset of the first node in the box
  // With spin: node minus point [m], and sum N arm^2 [m2], along each direction.
  alignas(64) double arm[spinning ? Dim : 1][n][lane_count];
  alignas(64) double spread[spinning ? Dim : 1][lane_count];
  int stride[3];
  double inverse_spacing[Dim];  // [1/m]

  /// `x[d]` points to the positions along d [m] of the points from `point` on, on a 64-byte boundary. The box holds all
  /// nodes of the points; a point within a rounding error of where it takes up the next node, as for products.
  Stencil(const Lattice<Dim>& lattice, const Shape& shape, const Box<Dim>& box, const double* const (&x)[Dim],
          int point) {
    Lanes E[Dim][Dim];
    for (int d = 0; d < Dim; ++d)
      for (int j = 0; j < Dim; ++j) E[d][j] = load(shape.domains + (d * Dim + j) * shape.stride + point);
    Lanes hat[corners][Dim][n], middle[Dim][n], offset{};
    for (int d = 0; d < Dim; ++d) {
      stride[d] = box.stride(d), inverse_spacing[d] = lattice.inverse_spacing()[d];
      const Lanes xi = (load(x[d]) - lattice.lower()[d]) * lattice.inverse_spacing()[d];
      const Lanes start = clamp(Shape::first_node(xi), box.lower[d], box.upper[d] - n);
      const Lanes at = xi - start;
      hats(at, middle[d]);
      for (int c = 0; c < corners; ++c) {
        Lanes corner = at;
        for (int j = 0; j < Dim; ++j) corner = c >> j & 1 ? corner + E[d][j] : corner - E[d][j];
        hats(corner, hat[c][d]);
      }
      if constexpr (spinning) reach_nodes(d, at, lattice.spacing()[d], hat);
      offset += (start - static_cast<double>(box.lower[d])) * static_cast<double>(stride[d]);
    }
    store(first, offset);
    Lanes inverse[Dim][Dim];  // E^-1 / corners
    invert(E, inverse);
    for (int node = 0; node < all; ++node) weigh(node, hat, middle, inverse);
  }

  /// Calls f(offset, weights) for every node of the point in `lane`.
  template <class F>
  void for_weights(int lane, F&& f) const {
    const int origin = static_cast<int>(first[lane]);
    for (int node = 0; node < all; ++node) {
      const int at[3] = {node % n, node / n % n, node / (n * n)};
      NodeWeights<Dim> w{value[node][lane], volume[node][lane], {}, {}};
      int offset = origin + at[0];
      for (int d = 0; d < Dim; ++d) {
        w.slope[d] = slope[d][node][lane];
        if constexpr (spinning) w.arm[d] = arm[d][at[d]][lane];
        if (d > 0) offset += at[d] * stride[d];
      }
      f(offset, w);
    }
  }

  /// Calls f(offset, weight, gradient[Dim]) for every node of the point in `lane`.
  template <class F>
  void for_nodes(int lane, F&& f) const {
    for_weights(lane, [&](int node, const NodeWeights<Dim>& w) { f(node, w.value, w.slope); });
  }

 private:
  /// Hat functions of n nodes at a place from the first of them, in cells.
  static void hats(Lanes at, Lanes (&hat)[n]) {
    for (int k = 0; k < n; ++k) {
      const Lanes far = 1.0 - absolute(at - static_cast<double>(k));
      hat[k] = select(far > 0.0, far, 0.0);
    }
  }

  void reach_nodes(int d, Lanes at, double spacing, const Lanes (&hat)[corners][Dim][n]) {
    Lanes sum{};
    for (int k = 0; k < n; ++k) {
      Lanes weight{};
      for (int c = 0; c < corners; ++c) weight += hat[c][d][k];
      const Lanes a = (static_cast<double>(k) - at) * spacing;
      store(arm[d][k], a);
      sum += weight * a * a;
    }
    store(spread[d], sum * (1.0 / corners));
  }

  static void invert(const Lanes (&E)[Dim][Dim], Lanes (&inverse)[Dim][Dim]) {
    if constexpr (Dim == 2) {
      const Lanes scale = 1.0 / (corners * (E[0][0] * E[1][1] - E[0][1] * E[1][0]));
      inverse[0][0] = scale * E[1][1], inverse[0][1] = -(scale * E[0][1]);
      inverse[1][0] = -(scale * E[1][0]), inverse[1][1] = scale * E[0][0];
    } else {
      const auto minor = [&](int i, int j) {
        const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, e = (j + 2) % 3;
        return E[a][c] * E[b][e] - E[a][e] * E[b][c];
      };
      const Lanes scale = 1.0 / (corners * (E[0][0] * minor(0, 0) + E[0][1] * minor(0, 1) + E[0][2] * minor(0, 2)));
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) inverse[j][i] = scale * minor(i, j);
    }
  }

  /// One node's weights. The sums over corners with signs are taken pair by pair, direction by direction.
  void weigh(int node, const Lanes (&hat)[corners][Dim][n], const Lanes (&middle)[Dim][n],
             const Lanes (&inverse)[Dim][Dim]) {
    const int at[3] = {node % n, node / n % n, node / (n * n)};
    Lanes sum[corners], central = middle[0][at[0]], odd[Dim];
    for (int d = 1; d < Dim; ++d) central *= middle[d][at[d]];
    for (int c = 0; c < corners; ++c) {
      sum[c] = hat[c][0][at[0]] * hat[c][1][at[1]];
      if constexpr (Dim == 3) sum[c] *= hat[c][2][at[2]];
    }
    for (int j = 0, left = corners / 2; j < Dim; ++j, left /= 2) {
      odd[j] = sum[1] - sum[0];
      for (int pair = 1; pair < left; ++pair) odd[j] += sum[2 * pair + 1] - sum[2 * pair];
      for (int pair = 0; pair < left; ++pair) sum[pair] = sum[2 * pair] + sum[2 * pair + 1];
    }
    const Lanes mean = sum[0] * (1.0 / corners);
    store(value[node], mean);
    store(volume[node], (2.0 / 3) * central + (1.0 / 3) * mean);
    for (int d = 0; d < Dim; ++d) {
      Lanes g = odd[0] * inverse[0][d];
      for (int j = 1; j < Dim; ++j) g += odd[j] * inverse[j][d];
      store(slope[d][node], g * inverse_spacing[d]);
    }
  }
};

}  // namespace cairn
