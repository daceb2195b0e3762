#pragma once
/// Sums over everything that have the same bits on any number of ranks: those of patches, in the order of the patches.

#include <array>
#include <map>

#include "cairn/grid/lattice.hpp"
#include "cairn/parallel/communicator.hpp"

namespace cairn {

template <std::size_t Size>
class PatchSums {
 public:
  using Values = std::array<double, Size>;

  /// What a patch of this rank adds; once for each patch, and nothing for those where it is all zero.
  void add(PatchId patch, const Values& values) {
    mine_.push_back(std::bit_cast<double>(patch));
    mine_.insert(mine_.end(), values.begin(), values.end());
  }
  /// Collective.
  Values on_all(MPI_Comm comm) const { return summed(gather_on_all(mine_, comm)); }
  /// Zeros on other ranks than the first. Collective.
  Values on_first(MPI_Comm comm) const { return summed(gather_on_first(mine_, comm)); }

 private:
  static Values summed(const std::vector<double>& records) {
    std::map<PatchId, const double*> ordered;
    for (std::size_t i = 0; i < records.size(); i += 1 + Size)
      ordered[std::bit_cast<PatchId>(records[i])] = &records[i + 1];
    Values sums{};
    for (const auto& [patch, values] : ordered)
      for (std::size_t i = 0; i < Size; ++i) sums[i] += values[i];
    return sums;
  }

  std::vector<double> mine_;
};

}  // namespace cairn
