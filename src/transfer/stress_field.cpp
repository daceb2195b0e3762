#include "kernels.hpp"

namespace cairn {

using namespace kernels;

template <int Dim>
void project_stress(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings) {
  using C = PointColumns<Dim>;
  using N = NodeStress<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  const Points<Dim>& points = piece.points;
  freeze_domains(piece, lattice, settings);
  nodes.sums.assign(nodes.storage() * N::width, 0.0);
  with_shape(settings, piece, [&](const auto& shape) {
    for_chunks(piece, lattice, shape, {add_rows(nodes.sums, N::width)}, [&](int first, int count, const auto& stencil) {
      alignas(64) double volume[lane_count];
      store(volume, load(points.column(C::volume) + first) * determinant(load_deformation(points, first)));
      for (int lane = 0; lane < count; ++lane) {
        Lanes value{};
        value[N::volume] = volume[lane];
        for (int i = 0; i < symmetric_size<Dim>; ++i)
          value[N::stress + i] = volume[lane] * points.column(C::stress + i)[first + lane];
        scatter<no_gradient, Lanes, N::width, Dim>(stencil, lane, value, {}, nodes.sums.data());
      }
    });
  });
}

template <int Dim>
std::vector<std::array<double, symmetric_size<Dim>>> smooth_stress(const Piece<Dim>& piece, const Lattice<Dim>& lattice,
                                                                   const TransferSettings<Dim>& settings) {
  using N = NodeStress<Dim>;
  std::vector<std::array<double, symmetric_size<Dim>>> smooth(piece.points.size());
  const double* rows = piece.nodes.sums.data();
  with_shape(settings, piece, [&](const auto& shape) {
    for_chunks(piece, lattice, shape, {read_rows(piece.nodes.sums, N::width)},
               [&](int first, int count, const auto& stencil) {
                 for (int lane = 0; lane < count; ++lane) {
                   Lanes sum{};
                   stencil.for_nodes(lane, [&](int node, double w, const double(&)[Dim]) {
                     const Lanes row = load(rows + static_cast<std::size_t>(node) * N::width);
                     if (row[N::volume] > 0) sum += row * (w / row[N::volume]);
                   });
                   for (int i = 0; i < symmetric_size<Dim>; ++i) smooth[first + lane][i] = sum[N::stress + i];
                 }
               });
  });
  return smooth;
}

#define CAIRN_INSTANTIATE(Dim)                                                                                        \
  template void project_stress(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&);                       \
  template std::vector<std::array<double, symmetric_size<Dim>>> smooth_stress(const Piece<Dim>&, const Lattice<Dim>&, \
                                                                              const TransferSettings<Dim>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
