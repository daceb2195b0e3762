#pragma once
/// The deformation gradient of one point; kernels load those of eight at once.

#include "cairn/body/points.hpp"
#include "cairn/core/tensor.hpp"

namespace cairn {

template <int Dim>
Tensor<Dim, double> deformation_of(const Points<Dim>& points, int p) {
  Tensor<Dim, double> F;
  for (int i = 0; i < tensor_size<Dim>; ++i) F.c[i] = points.column(PointColumns<Dim>::deformation + i)[p];
  return F;
}

/// Its determinant, the volume over that at the start.
template <int Dim>
double volume_ratio(const Points<Dim>& points, int p) {
  return determinant(deformation_of(points, p));
}

}  // namespace cairn
