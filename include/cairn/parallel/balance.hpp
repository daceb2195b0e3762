#pragma once
/// Load balance: whole patches move between ranks when the measured work has become uneven. Measured times decide where
/// patches live and nothing else, so that results stay the same bits.

#include <mpi.h>

#include "cairn/body/patch.hpp"
#include "cairn/parallel/distribution.hpp"

namespace cairn {

// Work and owners are those of the patches of a table, in its order.

/// Largest over mean of the ranks' work.
double imbalance_of(const std::vector<std::int64_t>& work, const std::vector<int>& owner, int ranks);

/// Renames the parts of a new partition so that as little work as possible changes rank.
std::vector<int> keep_in_place(const std::vector<int>& parts, const std::vector<int>& owner,
                               const std::vector<std::int64_t>& work, int ranks);

/// Sends every patch whose owner changes to its new rank, with its points, ledger and contacts, and assigns the table
/// anew. `patches` (ascending) are replaced. Collective.
template <int Dim>
void move_patches(std::vector<Patch<Dim>>& patches, PatchTable<Dim>& table, const std::vector<int>& new_owner,
                  const Lattice<Dim>& lattice, MPI_Comm comm);

}  // namespace cairn
