#pragma once
/// Which patches exist, and which rank holds which. The table is the same on every rank; each computes it for itself.
///
/// Points can be in any patch of the lattice, of which there may be very many; in the table are those that had points
/// since it was made and their neighbours, which share nodes with them. Nothing is kept of the others.

#include <cstdint>
#include <vector>

#include "cairn/core/options.hpp"
#include "cairn/grid/lattice.hpp"

namespace cairn {

/// Assigns patches to ranks, each to one. Returns the rank of each patch. By Partition:
/// - metis: on the graph of the patches, weighted by their work and by the nodes they share; beyond `most_for_metis`
///   patches, as every rank does all of it, like
/// - curve: cuts of a curve that fills the lattice, with equal work between them; a cut of `before` stays where it is
///   right to a twentieth of a rank's work, so that few patches move;
/// - round_robin: dealt out in turn, which is bad on purpose, to show that results do not depend on it.
/// \param patches  ascending
/// \param work     of each (its number of points), the same on every rank
/// \param before   the ranks of the patches now, if they have any
template <int Dim>
std::vector<int> distribute_patches(const Lattice<Dim>& lattice, const std::vector<PatchId>& patches,
                                    const std::vector<std::int64_t>& work, int ranks, Partition partition,
                                    const std::vector<int>& before = {});

inline constexpr std::ptrdiff_t most_for_metis = 1 << 14;

template <int Dim>
class PatchTable {
 public:
  PatchTable() = default;
  /// `filled`: those with points; `kept`: others that have to exist. Rank 0 holds all of them.
  PatchTable(const Lattice<Dim>& lattice, const std::vector<PatchId>& filled, const std::vector<PatchId>& kept = {});

  const std::vector<PatchId>& patches() const { return patches_; }  // ascending
  std::size_t size() const { return patches_.size(); }
  /// Place of a patch in the table, -1 where it is not there.
  std::ptrdiff_t find(PatchId patch) const;
  bool is_filled(PatchId patch) const {
    const std::ptrdiff_t at = find(patch);
    return at >= 0 && filled_[at];
  }
  /// The rank of a patch, be it in the table or not: that of the patch before it on a curve that fills the lattice,
  /// among those that were assigned. So all ranks know whose a patch is before there is anything in it.
  int owner(PatchId patch) const;
  std::vector<int> owners() const;  // of the table's patches
  /// Gives the table's patches to ranks.
  void assign(const std::vector<int>& owners);
  /// Notes patches that got points; returns those that are new in the table, ascending.
  std::vector<PatchId> fill(const std::vector<PatchId>& patches);
  /// Forgets all patches but those with points, their neighbours and others to keep. Owners stay.
  void restrict_to(const std::vector<PatchId>& filled, const std::vector<PatchId>& kept);

 private:
  struct Step {
    std::uint64_t code;
    int owner;
  };
  void insert(std::vector<PatchId>& patches);

  const Lattice<Dim>* lattice_ = nullptr;
  std::vector<PatchId> patches_;
  std::vector<bool> filled_;
  std::vector<Step> steps_;  // where the owner changes along the curve
};

}  // namespace cairn
