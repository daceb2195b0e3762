#include "kernels.hpp"

namespace cairn {
namespace {

using namespace kernels;

/// Mass, momentum, volume and gradient of one point at a time: a weighted sum of 1 + Dim vectors of eight.
template <int Dim, class Shape>
void scatter_sums(const Points<Dim>& points, int first, int count, const Stencil<Dim, Shape>& stencil, double density,
                  bool by_mass, double* sums) {
  using C = PointColumns<Dim>;
  using N = NodeSums<Dim>;
  alignas(64) double current[lane_count];
  store(current, load(points.column(C::volume) + first) * determinant(load_deformation(points, first)));
  for (int lane = 0; lane < count; ++lane) {
    const double mass = density * points.column(C::volume)[first + lane];
    Lanes value{};
    value[N::mass] = mass;
    value[N::volume] = current[lane];
    for (int d = 0; d < Dim; ++d) value[N::gradient + d] = by_mass ? mass : current[lane];
    scatter_moving<N::gradient>(points, first + lane, stencil, lane, mass, value, sums);
  }
}

/// Gradients with weights of their own.
template <int Dim>
void project_normals(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                     double density) {
  using C = PointColumns<Dim>;
  using N = NodeSums<Dim>;
  constexpr int half = row_width<Lanes4>, gradient = N::gradient - half;  // it lies in the second half of a row
  double* sums = piece.nodes.sums.data();
  for (std::size_t node = 0; node < piece.nodes.rows(); ++node)
    std::fill_n(sums + node * N::width + N::gradient, Dim, 0.0);
  with_normal_shape(settings, [&](const auto& shape) {
    const auto arrays = {add_rows(piece.nodes.sums, N::width)};
    for_chunks(piece, lattice, shape, arrays, [&](int first, int count, const auto& stencil) {
      alignas(64) double share[lane_count];
      const Lanes volume0 = load(piece.points.column(C::volume) + first);
      store(share, volume0 * (settings.normals.by_mass ? broadcast(density)
                                                       : determinant(load_deformation(piece.points, first))));
      for (int lane = 0; lane < count; ++lane) {
        Lanes4 value{};
        for (int d = 0; d < Dim; ++d) value[gradient + d] = share[lane];
        scatter<gradient, Lanes4, N::width, Dim>(stencil, lane, value, {}, sums + half);
      }
    });
  });
}

/// Volume-weighted stress, and position relative to the node.
template <int Dim>
void project_extras(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings) {
  using C = PointColumns<Dim>;
  using E = NodeExtras<Dim>;
  const Box<Dim>& box = piece.nodes.box;
  piece.nodes.extras.assign(piece.nodes.storage() * E::width, 0.0);
  with_shape(settings, piece, [&](const auto& shape) {
    for_chunks(piece.points, lattice, box, shape, [&](int first, int count, const auto& stencil) {
      const PointForce<Dim> stress(piece.points, first, 0, Vec<Dim>::Zero());
      alignas(64) double volume[lane_count];
      store(volume, load(piece.points.column(C::volume) + first) * determinant(load_deformation(piece.points, first)));
      for (int lane = 0; lane < count; ++lane)
        stencil.for_nodes(lane, [&](int node, double w, const double(&)[Dim]) {
          double* at = piece.nodes.extras.data() + static_cast<std::size_t>(node) * E::width;
          int place = 0;
          for (int i = 0; i < symmetric_size<Dim>; ++i)
            if (Dim == 3 || i != 2) at[E::stress + place++] += w * stress.flux[i][lane];
          int rest = node;
          for (int d = 0; d < Dim; ++d, rest /= box.extent(d - 1)) {
            const double node_x = lattice.node_position(d, box.lower[d] + rest % box.extent(d));
            at[E::position + d] += w * volume[lane] * (piece.points.column(d)[first + lane] - node_x);
          }
        });
    });
  });
}

/// Smallest and largest of n > 0 numbers that begin on a 64-byte boundary.
std::pair<double, double> extremes(const double* x, int n) {
  Lanes low = broadcast(x[0]), high = low;
  int p = 0;
  for (; p + lane_count <= n; p += lane_count) {
    const Lanes v = load(x + p);
    low = select(v < low, v, low), high = select(v > high, v, high);
  }
  double least = x[0], most = x[0];
  for (int lane = 0; lane < lane_count; ++lane) least = std::min(least, low[lane]), most = std::max(most, high[lane]);
  for (; p < n; ++p) least = std::min(least, x[p]), most = std::max(most, x[p]);
  return {least, most};
}

/// Nodes that the points touch: from their extreme positions. Empty without points.
template <int Dim>
Box<Dim> touched_nodes(const Points<Dim>& points, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings) {
  Box<Dim> box;
  if (points.size() == 0) return box;
  for (int d = 0; d < Dim; ++d) {
    const auto [low, high] = extremes(points.column(d), points.size());
    const double first = lattice.scaled(d, low), last = lattice.scaled(d, high);
    const auto widen = [&]<class Shape>(const Shape&) {
      const int lower = static_cast<int>(Shape::first_node(first)),
                upper = static_cast<int>(Shape::first_node(last)) + Shape::nodes;
      const bool unset = box.upper[d] <= box.lower[d];
      box.lower[d] = unset ? lower : std::min(box.lower[d], lower);
      box.upper[d] = unset ? upper : std::max(box.upper[d], upper);
    };
    with_shape(settings, {}, 0, widen);
    if (settings.normals_needed) with_normal_shape(settings, widen);
    // The image of a body that reaches a symmetry plane may touch the nodes beyond, which other bodies use.
    if (settings.mirrored[d][0] && box.lower[d] == 0) box.lower[d] = -1;
    if (settings.mirrored[d][1] && box.upper[d] == lattice.cells()[d] + 1) ++box.upper[d];
  }
  return box;
}

}  // namespace

template <int Dim>
TransferSettings<Dim> TransferSettings<Dim>::make(const SolverOptions& solver, const ContactOptions& contact,
                                                  const Vec<Dim>& gravity) {
  TransferSettings s;
  s.shape = solver.shape;
  const double per_direction = std::round(std::pow(solver.points_per_cell, 1.0 / Dim));
  s.half_size.fill(0.5 / per_direction);
  s.gravity = gravity;
  s.flip = solver.flip;
  s.spin = solver.spin;
  s.normals.by_mass = contact.normals != NormalSource::volume_gradient;
  if (contact.normals == NormalSource::density) s.normals.weights = NormalSettings::Weights::cell_density;
  // Gradients of linear hats tilt (a block on a plane loses 5 %): volume gradients take GIMP's weights instead.
  if (contact.normals == NormalSource::volume_gradient && solver.shape == ShapeFunction::linear)
    s.normals.weights = NormalSettings::Weights::gimp;
  s.normals_needed = contact.law == ContactLaw::frictionless || contact.law == ContactLaw::friction;
  for (const auto& pair : contact.pairs)
    s.normals_needed = s.normals_needed || pair.law == ContactLaw::frictionless || pair.law == ContactLaw::friction;
  s.extras = s.normals_needed && (contact.release == Release::traction || contact.separation > 0);
  return s;
}

template <int Dim>
void lay_out_nodes(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings) {
  piece.nodes.own = piece.nodes.box = touched_nodes(piece.points, lattice, settings);
  if (!piece.nodes.further.rows.empty()) piece.nodes.further.clear();
}

template <int Dim>
void project(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings, double density) {
  NodeBox<Dim>& nodes = piece.nodes;
  freeze_domains(piece, lattice, settings);
  nodes.sums.assign(nodes.storage() * NodeSums<Dim>::width, 0.0);
  nodes.force.assign(nodes.storage() * vector_width, 0.0);
  const bool own_weights = settings.normals.weights == NormalSettings::Weights::of_shape;
  with_moving_shape(settings, piece, [&](const auto& shape) {
    const auto arrays = {add_rows(nodes.sums, NodeSums<Dim>::width), add_rows(nodes.force, vector_width)};
    for_chunks(piece, lattice, shape, arrays, [&](int first, int count, const auto& stencil) {
      scatter_sums(piece.points, first, count, stencil, density, settings.normals.by_mass, nodes.sums.data());
      const PointForce<Dim> force(piece.points, first, density, settings.gravity);
      for (int lane = 0; lane < count; ++lane) force.scatter(stencil, lane, nodes.force.data());
    });
  });
  if (!own_weights && settings.normals_needed) project_normals(piece, lattice, settings, density);
  if (settings.extras) project_extras(piece, lattice, settings);
}

#define CAIRN_INSTANTIATE(Dim)                                                                 \
  template struct TransferSettings<Dim>;                                                       \
  template void lay_out_nodes(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&); \
  template void project(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
