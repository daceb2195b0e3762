#include "kernels.hpp"

namespace cairn {

using namespace kernels;

template <int Dim>
AlignedDoubles domains_of(const Points<Dim>& points, double stretch, const Lattice<Dim>& lattice,
                          const TransferSettings<Dim>& settings) {
  const std::ptrdiff_t stride = domain_stride(points.size());
  AlignedDoubles domains(static_cast<std::size_t>(stride) * Dim * Dim);
  for (int first = 0; first < points.size(); first += lane_count) {
    const Tensor<Dim, Lanes> F = load_deformation(points, first);
    for (int d = 0; d < Dim; ++d) {
      Lanes E[Dim], reach{};
      for (int j = 0; j < Dim; ++j) {
        const double half = settings.half_size[j] * lattice.spacing()[j] * lattice.inverse_spacing()[d] / stretch;
        E[j] = F.c[tensor_index<Dim>(d, j)] * half;
        reach += absolute(E[j]);
      }
      const Lanes shorter = select(reach > 0.5, 0.5 / reach, 1.0);
      for (int j = 0; j < Dim; ++j) store(domains.data() + (d * Dim + j) * stride + first, E[j] * shorter);
    }
  }
  return domains;
}

template <int Dim>
void freeze_domains(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings) {
  if (settings.shape == ShapeFunction::cpdi)
    piece.domains = domains_of(piece.points, settings.stretch_of(piece.body), lattice, settings);
}

#define CAIRN_INSTANTIATE(Dim)                                                                                       \
  template AlignedDoubles domains_of(const Points<Dim>&, double, const Lattice<Dim>&, const TransferSettings<Dim>&); \
  template void freeze_domains(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
