#pragma once
/// The pieces that every transfer is made of: loops over points, eight at a time, and what is gathered or scattered.
/// Nodes are visited point by point, and a node's quantities lie side by side: one vector operation serves them all.
/// Weights are products: what a row of nodes along x has in common is multiplied once for the row.

#include <algorithm>
#include <limits>

#include "cairn/grid/cpdi.hpp"
#include "cairn/transfer/transfer.hpp"
#include "cut_blocks.hpp"

namespace cairn::kernels {

/// Calls f(shape) with the settings' shape function; `domains` are those of so many points, for CPDI.
template <int Dim, class F>
void with_shape(const TransferSettings<Dim>& settings, const AlignedDoubles& domains, int points, F&& f) {
  switch (settings.shape) {
    case ShapeFunction::linear:
      return f(LinearShape{});
    case ShapeFunction::gimp:
      return f(GimpShape{settings.half_size});
    case ShapeFunction::bspline2:
      return f(QuadraticShape{});
    case ShapeFunction::cpdi:
      return f(CpdiShape{{}, domains.data(), domain_stride(points)});
  }
}
template <int Dim, class F>
void with_shape(const TransferSettings<Dim>& settings, const Piece<Dim>& piece, F&& f) {
  with_shape(settings, piece.domains, piece.points.size(), f);
}

/// As with_shape, for what moves points or their momentum: the shape is `Spinning` where points carry spin.
template <int Dim, class F>
void with_moving_shape(const TransferSettings<Dim>& settings, const Piece<Dim>& piece, F&& f) {
  with_shape(settings, piece,
             [&]<class Shape>(const Shape& shape) { settings.spin ? f(Spinning<Shape>{shape}) : f(shape); });
}

/// Calls f(shape) with the weights of the normals, where they are not those of the shape function.
template <int Dim, class F>
void with_normal_shape(const TransferSettings<Dim>& settings, F&& f) {
  if (settings.normals.weights == NormalSettings::Weights::gimp) f(GimpShape{settings.half_size});
  if (settings.normals.weights == NormalSettings::Weights::cell_density) f(CellDensityShape{});
}

/// Calls f(first, count, stencil) for every eight points (fewer at the end).
template <int Dim, class Shape, class F>
void for_chunks(const Points<Dim>& points, const Lattice<Dim>& lattice, const Box<Dim>& box, const Shape& shape,
                F&& f) {
  for (int first = 0; first < points.size(); first += lane_count) {
    const double* x[Dim];
    for (int d = 0; d < Dim; ++d) x[d] = points.column(d) + first;
    const Stencil<Dim, Shape> stencil(lattice, shape, box, x, first);
    f(first, std::min(lane_count, points.size() - first), stencil);
  }
}

/// As above, for a piece of which some points see nodes across cracks.
template <int Dim, class Shape, class F>
[[gnu::noinline]] void for_cut_chunks(const Piece<Dim>& piece, const Lattice<Dim>& lattice, const Shape& shape,
                                      std::initializer_list<RowArray> arrays, F&& f) {
  const Points<Dim>& points = piece.points;
  CutBlocks<Dim> blocks(piece.nodes, arrays, Shape::nodes);
  for (int first = 0; first < points.size(); first += lane_count) {
    const double* x[Dim];
    for (int d = 0; d < Dim; ++d) x[d] = points.column(d) + first;
    Stencil<Dim, Shape> stencil(lattice, shape, piece.nodes.box, x, first);
    const int count = std::min(lane_count, points.size() - first);
    const bool cut = blocks.reach(first);
    if (cut) blocks.enter(count, stencil.first, stencil.stride);
    f(first, count, std::as_const(stencil));
    if (cut) blocks.leave();
  }
}

/// As above, for the points and nodes of a piece. `arrays` are those that f reads of the nodes, and those it adds to.
template <int Dim, class Shape, class F>
void for_chunks(const Piece<Dim>& piece, const Lattice<Dim>& lattice, const Shape& shape,
                std::initializer_list<RowArray> arrays, F&& f) {
  if (piece.nodes.further.scratch > 0) return for_cut_chunks(piece, lattice, shape, arrays, f);
  for_chunks(piece.points, lattice, piece.nodes.box, shape, f);
}

/// Calls f(s, i, j) for every component s of a spin, which turns direction i towards j.
template <int Dim, class F>
void for_spins(F&& f) {
  for (int s = 0; s < spin_size<Dim>; ++s) Dim == 2 ? f(s, 0, 1) : f(s, (s + 1) % 3, (s + 2) % 3);
}

/// A node's row of four or eight quantities.
template <class Row>
inline constexpr int row_width = sizeof(Row) / sizeof(double);
template <class Row>
Row load_row(const double* rows, int node) {
  if constexpr (row_width<Row> == 4)
    return load4(rows + node * 4);
  else
    return load(rows + node * 8);
}
template <int stride, class Row>
void add_row(double* rows, int node, Row row) {
  if constexpr (row_width<Row> == 4)
    store4(rows + node * stride, load4(rows + node * stride) + row);
  else
    store(rows + node * stride, load(rows + node * stride) + row);
}

inline constexpr int no_gradient = -1;

/// Whether the weights of a stencil are products.
template <class S>
inline constexpr bool is_product = requires(const S& stencil) {
  stencil.along_x(0);
};

template <class Row>
Row equal_row(double a) {
  if constexpr (row_width<Row> == 4)
    return broadcast4(a);
  else
    return broadcast(a);
}

/// The row with the momentum p alone: where NodeSums has it, or at the start of a row of four.
template <class Row, int Dim>
Row momentum_row(const double (&p)[Dim]) {
  static_assert(NodeSums<Dim>::momentum == 1);
  const double z = Dim == 3 ? p[Dim - 1] : 0.0;
  if constexpr (row_width<Row> == 4)
    return Row{p[0], p[1], z, 0};
  else
    return Row{0, p[0], p[1], z, 0, 0, 0, 0};
}

/// Adds N times `value` to the rows of a point's nodes; in the columns from `gradient` on, grad N takes the place of N.
/// `turn[d]` times the arm along d is added to `value` first (with spin). Rows begin `stride` numbers apart. A sum of
/// volume is that before the gradient.
template <int gradient, class Row, int stride = row_width<Row>, int Dim, class Shape>
void scatter(const Stencil<Dim, Shape>& stencil, int lane, const Row& value, const Row (&turn)[Dim], double* rows) {
  using S = Stencil<Dim, Shape>;
  if constexpr (!is_product<S>) {
    stencil.for_weights(lane, [&](int node, const NodeWeights<Dim>& at) {
      Row factor = equal_row<Row>(at.value), sum = value;
      if constexpr (gradient != no_gradient) {
        factor[gradient - 1] = at.volume;
        for (int d = 0; d < Dim; ++d) factor[gradient + d] = at.slope[d];
      }
      if constexpr (S::spinning)
        for (int d = 0; d < Dim; ++d) sum += turn[d] * at.arm[d];
      add_row<stride>(rows, node, sum * factor);
    });
  } else {
    const auto x = stencil.along_x(lane);
    Row factor[S::n];
    for (int i = 0; i < S::n; ++i) {
      factor[i] = equal_row<Row>(x.value[i]);
      if constexpr (gradient != no_gradient) factor[i][gradient] = x.slope[i];
    }
    stencil.for_rows(lane, [&](int node, const RowWeights<Dim>& row) {
      Row common = equal_row<Row>(row.value), sum = value;
      if constexpr (gradient != no_gradient)
        for (int d = 1; d < Dim; ++d) common[gradient + d] = row.slope[d];
      if constexpr (S::spinning)
        for (int d = 1; d < Dim; ++d) sum += turn[d] * row.arm[d];
      sum *= common;
      for (int i = 0; i < S::n; ++i) {
        Row given = sum * factor[i];
        if constexpr (S::spinning) given += turn[0] * (row.value * x.lever[i]);
        add_row<stride>(rows, node + i, given);
      }
    });
  }
}

/// As scatter, with the momentum m (v + w x arm) of point p besides `value`.
template <int gradient, class Row, int Dim, class Shape>
void scatter_moving(const Points<Dim>& points, int p, const Stencil<Dim, Shape>& stencil, int lane, double mass,
                    const Row& value, double* rows) {
  using C = PointColumns<Dim>;
  double momentum[Dim];
  for (int d = 0; d < Dim; ++d) momentum[d] = mass * points.column(C::velocity + d)[p];
  Row turn[Dim] = {};  // m w x the unit vector along d
  if constexpr (Stencil<Dim, Shape>::spinning) {
    double w[spin_size<Dim>];
    for (int s = 0; s < spin_size<Dim>; ++s) w[s] = mass * points.column(C::spin + s)[p];
    if constexpr (Dim == 2) {
      turn[0] = momentum_row<Row, 2>({0, w[0]}), turn[1] = momentum_row<Row, 2>({-w[0], 0});
    } else {
      turn[0] = momentum_row<Row, 3>({0, w[2], -w[1]});
      turn[1] = momentum_row<Row, 3>({-w[2], 0, w[0]});
      turn[2] = momentum_row<Row, 3>({w[1], -w[0], 0});
    }
  }
  scatter<gradient>(stencil, lane, value + momentum_row<Row>(momentum), turn, rows);
}

/// The deformation gradient of eight points.
template <int Dim>
Tensor<Dim, Lanes> load_deformation(const Points<Dim>& points, int first) {
  Tensor<Dim, Lanes> F;
  for (int i = 0; i < tensor_size<Dim>; ++i) F.c[i] = load(points.column(PointColumns<Dim>::deformation + i) + first);
  return F;
}

/// A = dt L of eight points, L = sum v (x) grad N.
template <int Dim, class Shape>
Tensor<Dim, Lanes> gather_strain(const Stencil<Dim, Shape>& stencil, int count, const double* velocity, double dt) {
  alignas(64) double rows[Dim][Dim][lane_count] = {};
  for (int lane = 0; lane < count; ++lane) {
    Lanes4 sum[Dim] = {};
    if constexpr (!is_product<Stencil<Dim, Shape>>) {
      stencil.for_weights(lane, [&](int node, const NodeWeights<Dim>& at) {
        const Lanes4 v = load_row<Lanes4>(velocity, node);
        for (int j = 0; j < Dim; ++j) sum[j] += v * at.slope[j];
      });
    } else {
      const auto x = stencil.along_x(lane);
      stencil.for_rows(lane, [&](int node, const RowWeights<Dim>& row) {
        Lanes4 by_value{}, by_slope{};
        for (int i = 0; i < Stencil<Dim, Shape>::n; ++i) {
          const Lanes4 v = load_row<Lanes4>(velocity, node + i);
          by_value += v * x.value[i], by_slope += v * x.slope[i];
        }
        sum[0] += by_slope * row.value;
        for (int j = 1; j < Dim; ++j) sum[j] += by_value * row.slope[j];
      });
    }
    for (int i = 0; i < Dim; ++i)
      for (int j = 0; j < Dim; ++j) rows[i][j][lane] = dt * sum[j][i];
  }
  Tensor<Dim, Lanes> A{};
  for (int i = 0; i < Dim; ++i)
    for (int j = 0; j < Dim; ++j) A.c[tensor_index<Dim>(i, j)] = load(rows[i][j]);
  return A;
}

/// The squared wave speeds a; infinite where a point is inverted, or its J or stress is not finite.
template <int Dim>
Lanes guarded(Lanes a, Lanes J, const Symmetric<Dim, Lanes>& stress) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Lanes zero = 0.0 * a;  // stays 0 unless something is not finite
  for (int i = 0; i < symmetric_size<Dim>; ++i) zero += 0.0 * stress.c[i];
  return select((J > 0.0) & (J < infinity) & (zero == 0.0), a, infinity);
}

/// Largest of the first `count` lanes and `so_far`.
inline double largest(Lanes a, int count, double so_far) {
  for (int lane = 0; lane < count; ++lane) so_far = std::max(so_far, a[lane]);
  return so_far;
}

/// Deformation gradient, stress and state of eight points from A = dt L; returns the largest squared wave speed,
/// infinite where one of them is `guarded`.
template <int Dim, class ConcreteLaw>
double apply_law(Points<Dim>& points, int first, int count, const ConcreteLaw& law, const Tensor<Dim, Lanes>& A,
                 double inverse_density, double so_far) {
  using C = PointColumns<Dim>;
  constexpr int states = static_cast<int>(ConcreteLaw::state_names.size());
  Tensor<Dim, Lanes> F = load_deformation(points, first);
  Symmetric<Dim, Lanes> stress;
  Lanes state[states + 1];
  for (int i = 0; i < symmetric_size<Dim>; ++i) stress.c[i] = load(points.column(C::stress + i) + first);
  for (int i = 0; i < states; ++i) state[i] = load(points.column(C::state + i) + first);
  const Lanes modulus = advance_point(law, A, F, stress, state);
  for (int i = 0; i < tensor_size<Dim>; ++i) store(points.column(C::deformation + i) + first, F.c[i]);
  for (int i = 0; i < symmetric_size<Dim>; ++i) store(points.column(C::stress + i) + first, stress.c[i]);
  for (int i = 0; i < states; ++i) store(points.column(C::state + i) + first, state[i]);
  return largest(guarded(modulus * inverse_density, determinant(F), stress), count, so_far);
}

/// Force of eight points on the nodes: -V sigma . grad N + m g N, V = V0 det F the current volume.
template <int Dim>
struct PointForce {
  alignas(64) double flux[symmetric_size<Dim>][lane_count];  // V sigma
  alignas(64) double mass[lane_count];
  Lanes4 gravity{};

  PointForce(const Points<Dim>& points, int first, double density, const Vec<Dim>& g) {
    using C = PointColumns<Dim>;
    const Lanes volume0 = load(points.column(C::volume) + first);
    const Lanes volume = volume0 * determinant(load_deformation(points, first));
    for (int i = 0; i < symmetric_size<Dim>; ++i) store(flux[i], volume * load(points.column(C::stress + i) + first));
    store(mass, density * volume0);
    for (int d = 0; d < Dim; ++d) gravity[d] = g[d];
  }

  template <class Shape>
  void scatter(const Stencil<Dim, Shape>& stencil, int lane, double* force) const {
    const auto column = [&](int j) {  // of -V sigma
      double c[Dim];
      for (int i = 0; i < Dim; ++i) c[i] = -flux[symmetric_index<Dim>(i, j)][lane];
      return momentum_row<Lanes4>(c);
    };
    Lanes4 columns[Dim];
    for (int j = 0; j < Dim; ++j) columns[j] = column(j);
    const Lanes4 weight = gravity * mass[lane];
    if constexpr (!is_product<Stencil<Dim, Shape>>) {
      stencil.for_weights(lane, [&](int node, const NodeWeights<Dim>& at) {
        Lanes4 given = weight * at.value;
        for (int j = 0; j < Dim; ++j) given += columns[j] * at.slope[j];
        add_row<vector_width>(force, node, given);
      });
    } else {
      const auto x = stencil.along_x(lane);
      stencil.for_rows(lane, [&](int node, const RowWeights<Dim>& row) {
        const Lanes4 by_slope = columns[0] * row.value;
        Lanes4 by_value = weight * row.value;
        for (int j = 1; j < Dim; ++j) by_value += columns[j] * row.slope[j];
        for (int i = 0; i < Stencil<Dim, Shape>::n; ++i)
          add_row<vector_width>(force, node + i, by_slope * x.slope[i] + by_value * x.value[i]);
      });
    }
  }
};

}  // namespace cairn::kernels
