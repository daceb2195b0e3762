#pragma once
/// Memory: what a run will need, and what there is.

#include <cstdint>
#include <vector>

#include "cairn/core/options.hpp"
#include "cairn/parallel/communicator.hpp"

namespace cairn {

/// Bytes that a rank with so many points will need at the least for points and nodes. `extras`: the release needs them.
template <int Dim>
double estimated_memory(std::int64_t points, const SolverOptions& solver, bool extras);

/// Compares what the ranks of each machine need with what it has free. Collective.
/// \throws InputError on every rank if a machine has too little
void require_memory(double bytes, MPI_Comm comm);

}  // namespace cairn
