#include "kernels.hpp"

namespace cairn {

using namespace kernels;

template <int Dim>
std::vector<std::array<double, Dim + Dim * Dim>> point_kinematics(const Piece<Dim>& piece, const Lattice<Dim>& lattice,
                                                                  const TransferSettings<Dim>& settings) {
  using M = NodeMotion<Dim>;
  std::vector<std::array<double, Dim + Dim * Dim>> all(piece.points.size());
  const double* motion = piece.nodes.motion.data();
  with_shape(settings, piece, [&](const auto& shape) {
    for_chunks(piece, lattice, shape, {read_rows(piece.nodes.motion, M::width)},
               [&](int first, int count, const auto& stencil) {
                 for (int lane = 0; lane < count; ++lane) {
                   auto& at = all[first + lane];
                   at.fill(0);
                   stencil.for_nodes(lane, [&](int node, double w, const double(&gradient)[Dim]) {
                     const double* row = motion + static_cast<std::size_t>(node) * M::width;
                     for (int i = 0; i < Dim; ++i) {
                       at[i] += w * row[M::acceleration + i];
                       for (int j = 0; j < Dim; ++j) at[Dim + Dim * i + j] += row[M::velocity + i] * gradient[j];
                     }
                   });
                 }
               });
  });
  return all;
}

template std::vector<std::array<double, 6>> point_kinematics(const Piece<2>&, const Lattice<2>&,
                                                             const TransferSettings<2>&);
template std::vector<std::array<double, 12>> point_kinematics(const Piece<3>&, const Lattice<3>&,
                                                              const TransferSettings<3>&);

}  // namespace cairn
