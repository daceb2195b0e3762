#pragma once
/// The pieces that every transfer is made of: loops over points, eight at a time, and what is gathered or scattered.
/// Nodes are visited point by point, and a node's quantities lie side by side: one vector operation serves them all.

#include <algorithm>
#include <limits>

#include "cairn/grid/shape_functions.hpp"
#include "cairn/transfer/transfer.hpp"

namespace cairn::kernels {

/// Calls f(shape) with the settings' shape function.
template <int Dim, class F>
void with_shape(const TransferSettings<Dim>& settings, F&& f) {
  switch (settings.shape) {
    case ShapeFunction::linear:
      return f(LinearShape{});
    case ShapeFunction::gimp:
      return f(GimpShape{settings.half_size});
    case ShapeFunction::bspline2:
      return f(QuadraticShape{});
  }
}

/// As with_shape, for what moves points or their momentum: the shape is `Spinning` where points carry spin.
template <int Dim, class F>
void with_moving_shape(const TransferSettings<Dim>& settings, F&& f) {
  with_shape(settings, [&]<class Shape>(const Shape& shape) { settings.spin ? f(Spinning<Shape>{shape}) : f(shape); });
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
    const Stencil<Dim, Shape> stencil(lattice, shape, box, x);
    f(first, std::min(lane_count, points.size() - first), stencil);
  }
}

/// Calls f(s, i, j) for every component s of a spin, which turns direction i towards j.
template <int Dim, class F>
void for_spins(F&& f) {
  for (int s = 0; s < spin_size<Dim>; ++s) Dim == 2 ? f(s, 0, 1) : f(s, (s + 1) % 3, (s + 2) % 3);
}

/// Calls add(node, row, gradient) for every node of point p with what it gives to the node's row: N times `value`,
/// where the momentum m (v + w x arm) takes the columns from `momentum` on.
template <int momentum, class Row, int Dim, class Shape, class F>
void scatter_row(const Points<Dim>& points, int p, const Stencil<Dim, Shape>& stencil, int lane, double mass, Row value,
                 F&& add) {
  using C = PointColumns<Dim>;
  for (int d = 0; d < Dim; ++d) value[momentum + d] = mass * points.column(C::velocity + d)[p];
  if constexpr (Stencil<Dim, Shape>::spinning) {
    Row turn[Dim] = {};  // for each direction of the arm
    for_spins<Dim>([&](int s, int i, int j) {
      const double w = mass * points.column(C::spin + s)[p];
      turn[i][momentum + j] += w, turn[j][momentum + i] -= w;
    });
    stencil.for_nodes(lane, [&](int node, double w, const double(&g)[Dim], const double(&arm)[Dim]) {
      Row sum = value;
      for (int d = Dim - 1; d >= 0; --d) sum += turn[d] * arm[d];
      add(node, sum * w, g);
    });
  } else {
    stencil.for_nodes(lane, [&](int node, double w, const double(&g)[Dim]) { add(node, value * w, g); });
  }
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
    stencil.for_nodes(lane, [&](int node, double /*w*/, const double(&g)[Dim]) {
      const Lanes4 v = load4(velocity + node * vector_width);
      for (int j = 0; j < Dim; ++j) sum[j] += v * g[j];
    });
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
    Lanes4 column[Dim] = {};  // column j of V sigma
    for (int j = 0; j < Dim; ++j)
      for (int i = 0; i < Dim; ++i) column[j][i] = -flux[symmetric_index<Dim>(i, j)][lane];
    const Lanes4 weight = gravity * mass[lane];
    stencil.for_nodes(lane, [&](int node, double w, const double(&g)[Dim]) {
      double* f = force + node * vector_width;
      Lanes4 sum = load4(f) + weight * w;
      for (int j = 0; j < Dim; ++j) sum += column[j] * g[j];
      store4(f, sum);
    });
  }
};

}  // namespace cairn::kernels
