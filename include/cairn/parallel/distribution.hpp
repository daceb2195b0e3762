#pragma once
/// Which rank holds which patch. The table is the same on every rank; each computes it for itself.

#include <cstdint>
#include <vector>

#include "cairn/core/options.hpp"
#include "cairn/grid/lattice.hpp"

namespace cairn {

/// Assigns every patch to a rank: by METIS on the graph of patches, weighted by their work and by the nodes they share;
/// or dealt out in turn, which is bad on purpose, to show that results do not depend on it.
/// \param work  of each patch (its number of points), the same on every rank
template <int Dim>
std::vector<int> distribute_patches(const Lattice<Dim>& lattice, const std::vector<std::int64_t>& work, int ranks,
                                    Partition partition);

}  // namespace cairn
