#pragma once
/// How far apart a crack's faces are at a node.

#include "cairn/body/patch.hpp"

namespace cairn::contact {

/// Opening of crack c along its normal at x [m]: of the crack points of the patch within a cell, weighted by hat
/// functions; where there are none, of the nearest. The faces turn with the material; gaps from displacements would not
/// (docs/cracks.md). Zero where the patch knows no point of the crack.
template <int Dim>
double crack_gap(const Patch<Dim>& patch, const Lattice<Dim>& lattice, int c, const Vec<Dim>& x,
                 const Vec<Dim>& normal) {
  auto at = std::lower_bound(patch.cracks.begin(), patch.cracks.end(), c,
                             [](const CrackPoint<Dim>& p, int crack) { return p.crack < crack; });
  double weights = 0, sum = 0, nearest = std::numeric_limits<double>::infinity(), there = 0;
  for (; at != patch.cracks.end() && at->crack == c; ++at) {
    const Vec<Dim> away = (at->plane - x).cwiseProduct(lattice.inverse_spacing());
    const double opening = at->opening().dot(normal), squared = away.squaredNorm();
    double weight = 1;
    for (int d = 0; d < Dim; ++d) weight *= std::max(0.0, 1 - std::abs(away[d]));
    weights += weight, sum += weight * opening;
    if (squared < nearest) nearest = squared, there = opening;
  }
  return weights > 0 ? sum / weights : there;
}

}  // namespace cairn::contact
