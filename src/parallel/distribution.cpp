#include "cairn/parallel/distribution.hpp"

#include <metis.h>

#include <algorithm>
#include <cmath>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

/// Adjacency of the patches in METIS's form; edges weigh as many nodes as the two patches share.
struct Graph {
  std::vector<idx_t> starts{0}, neighbours, edge_weights, vertex_weights;
};

template <int Dim>
Graph build_graph(const Lattice<Dim>& lattice, const std::vector<PatchId>& patches,
                  const std::vector<std::int64_t>& work) {
  Graph graph;
  // METIS adds weights in idx_t: scale so that sums stay far from its range. One more for each patch spreads empty
  // ones.
  std::int64_t total = 0;
  for (auto w : work) total += w;
  const std::int64_t unit = 1 + total / (std::int64_t{1} << 28);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const PatchId patch = patches[p];
    std::vector<std::pair<PatchId, std::size_t>> shared;
    for (const auto& link : lattice.unpaired_links(patch)) {
      if (link.patch == patch || !std::ranges::binary_search(patches, link.patch)) continue;
      const auto nodes =
          intersection(lattice.patch_nodes(patch), lattice.patch_nodes(link.patch).shifted(link.shift)).size();
      if (!shared.empty() && shared.back().first == link.patch)
        shared.back().second += nodes;
      else
        shared.emplace_back(link.patch, nodes);
    }
    for (const auto& [neighbour, nodes] : shared) {
      graph.neighbours.push_back(static_cast<idx_t>(std::ranges::lower_bound(patches, neighbour) - patches.begin()));
      graph.edge_weights.push_back(static_cast<idx_t>(nodes));
    }
    graph.starts.push_back(static_cast<idx_t>(graph.neighbours.size()));
    graph.vertex_weights.push_back(static_cast<idx_t>(1 + work[p] / unit));
  }
  return graph;
}

/// Place of a patch on the curve of Morton (1966): the bits of its position taken in turn.
template <int Dim>
std::uint64_t place_on_curve(const Lattice<Dim>& lattice, PatchId patch) {
  const Index<Dim> position = lattice.patch_position(patch);
  std::uint64_t code = 0;
  for (int bit = 0; bit < 64 / Dim; ++bit)
    for (int d = 0; d < Dim; ++d) code |= (static_cast<std::uint64_t>(position[d]) >> bit & 1) << (bit * Dim + d);
  return code;
}

/// The patches in the order of the curve.
template <int Dim>
std::vector<std::size_t> along_curve(const Lattice<Dim>& lattice, const std::vector<PatchId>& patches) {
  std::vector<std::pair<std::uint64_t, std::size_t>> places;
  for (std::size_t p = 0; p < patches.size(); ++p) places.emplace_back(place_on_curve(lattice, patches[p]), p);
  std::ranges::sort(places);
  std::vector<std::size_t> order;
  for (const auto& [code, p] : places) order.push_back(p);
  return order;
}

/// Where ranks 1 and on begin in a sequence of patches, of which each has one at least.
/// \param sums    work of those before each place of the sequence, and at last of all
/// \param before  the ranks now, in the order of the sequence, or nothing
std::vector<std::size_t> cuts_of(const std::vector<double>& sums, const std::vector<int>& before, int ranks) {
  const std::size_t count = sums.size() - 1;
  const double share = sums.back() / ranks, slack = 0.05 * share;
  const bool anchored = !before.empty() && std::ranges::is_sorted(before);
  std::vector<std::size_t> cuts;
  for (int rank = 1; rank < ranks; ++rank) {
    const double wanted = rank * share;
    auto cut = static_cast<std::size_t>(std::ranges::lower_bound(sums, wanted) - sums.begin());
    if (cut > 0 && wanted - sums[cut - 1] < sums[cut] - wanted) --cut;
    if (anchored) {
      const auto old = static_cast<std::size_t>(std::ranges::lower_bound(before, rank) - before.begin());
      if (std::abs(sums[old] - wanted) <= slack) cut = old;
    }
    cuts.push_back(std::clamp(cut, cuts.empty() ? 1 : cuts.back() + 1, count - static_cast<std::size_t>(ranks - rank)));
  }
  return cuts;
}

/// Ranks along the curve.
template <int Dim>
std::vector<int> cut_curve(const Lattice<Dim>& lattice, const std::vector<PatchId>& patches,
                           const std::vector<std::int64_t>& work, int ranks, const std::vector<int>& before) {
  const auto order = along_curve(lattice, patches);
  std::vector<double> sums{0};
  std::vector<int> now;
  for (const std::size_t p : order) {
    sums.push_back(sums.back() + 1 + static_cast<double>(work[p]));  // as METIS's weights: one more for each patch
    if (!before.empty()) now.push_back(before[p]);
  }
  const auto cuts = cuts_of(sums, now, ranks);
  std::vector<int> owner(patches.size());
  int rank = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    while (rank < ranks - 1 && i >= cuts[rank]) ++rank;
    owner[order[i]] = rank;
  }
  return owner;
}

template <int Dim>
std::vector<int> ask_metis(const Lattice<Dim>& lattice, const std::vector<PatchId>& patches,
                           const std::vector<std::int64_t>& work, int ranks) {
  Graph graph = build_graph(lattice, patches, work);
  idx_t vertices = static_cast<idx_t>(patches.size()), constraints = 1, parts = ranks, cut = 0;
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  options[METIS_OPTION_UFACTOR] = 20;  // imbalance up to 1.02
  std::vector<idx_t> part(patches.size(), 0);
  const auto method = ranks <= 8 ? METIS_PartGraphRecursive : METIS_PartGraphKway;
  const int status =
      method(&vertices, &constraints, graph.starts.data(), graph.neighbours.data(), graph.vertex_weights.data(),
             nullptr, graph.edge_weights.data(), &parts, nullptr, nullptr, options, &cut, part.data());
  if (status != METIS_OK) throw RunError("METIS could not partition the patches");
  return {part.begin(), part.end()};
}

}  // namespace

template <int Dim>
std::vector<int> distribute_patches(const Lattice<Dim>& lattice, const std::vector<PatchId>& patches,
                                    const std::vector<std::int64_t>& work, int ranks, Partition partition,
                                    const std::vector<int>& before) {
  std::vector<int> owner(patches.size(), 0);
  if (ranks == 1) return owner;
  if (partition == Partition::round_robin || std::ssize(patches) <= ranks) {
    for (std::size_t p = 0; p < owner.size(); ++p) owner[p] = static_cast<int>(p % ranks);
    return owner;
  }
  if (partition == Partition::metis && std::ssize(patches) <= most_for_metis)
    return ask_metis(lattice, patches, work, ranks);
  return cut_curve(lattice, patches, work, ranks, before);
}

template <int Dim>
PatchTable<Dim>::PatchTable(const Lattice<Dim>& lattice, const std::vector<PatchId>& filled,
                            const std::vector<PatchId>& kept)
    : lattice_(&lattice), steps_{{0, 0}} {
  restrict_to(filled, kept);
}

template <int Dim>
void PatchTable<Dim>::restrict_to(const std::vector<PatchId>& filled, const std::vector<PatchId>& kept) {
  patches_.clear(), filled_.clear();
  std::vector<PatchId> others = kept;
  insert(others);
  fill(filled);
}

template <int Dim>
std::ptrdiff_t PatchTable<Dim>::find(PatchId patch) const {
  const auto at = std::ranges::lower_bound(patches_, patch);
  return at != patches_.end() && *at == patch ? at - patches_.begin() : -1;
}

template <int Dim>
int PatchTable<Dim>::owner(PatchId patch) const {
  if (steps_.size() == 1) return steps_.front().owner;
  const auto after = std::ranges::upper_bound(steps_, place_on_curve(*lattice_, patch), {}, &Step::code);
  return after == steps_.begin() ? steps_.front().owner : std::prev(after)->owner;
}

template <int Dim>
std::vector<int> PatchTable<Dim>::owners() const {
  std::vector<int> owners;
  for (const PatchId patch : patches_) owners.push_back(owner(patch));
  return owners;
}

template <int Dim>
void PatchTable<Dim>::assign(const std::vector<int>& owners) {
  steps_.clear();
  for (std::size_t p = 0; p < patches_.size(); ++p)
    steps_.push_back({place_on_curve(*lattice_, patches_[p]), owners[p]});
  std::ranges::sort(steps_, {}, &Step::code);
  steps_.erase(
      std::unique(steps_.begin(), steps_.end(), [](const Step& a, const Step& b) { return a.owner == b.owner; }),
      steps_.end());
  if (steps_.empty()) steps_.push_back({0, 0});
}

/// Adds patches that are not in the table yet; leaves those that were added, ascending.
template <int Dim>
void PatchTable<Dim>::insert(std::vector<PatchId>& patches) {
  std::ranges::sort(patches);
  patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
  std::erase_if(patches, [&](PatchId patch) { return find(patch) >= 0; });
  if (patches.empty()) return;
  std::vector<PatchId> all;
  std::vector<bool> filled;
  for (std::size_t old = 0, added = 0; old < patches_.size() || added < patches.size();) {
    const bool take_old = added == patches.size() || (old < patches_.size() && patches_[old] < patches[added]);
    filled.push_back(take_old && filled_[old]);
    all.push_back(take_old ? patches_[old++] : patches[added++]);
  }
  patches_ = std::move(all), filled_ = std::move(filled);
}

template <int Dim>
std::vector<PatchId> PatchTable<Dim>::fill(const std::vector<PatchId>& patches) {
  std::vector<PatchId> added;
  for (const PatchId patch : patches) {
    if (is_filled(patch)) continue;
    added.push_back(patch);
    for (const auto& link : lattice_->unpaired_links(patch)) added.push_back(link.patch);
  }
  insert(added);
  for (const PatchId patch : patches) filled_[find(patch)] = true;
  return added;
}

template class PatchTable<2>;
template class PatchTable<3>;
template std::vector<int> distribute_patches(const Lattice<2>&, const std::vector<PatchId>&,
                                             const std::vector<std::int64_t>&, int, Partition, const std::vector<int>&);
template std::vector<int> distribute_patches(const Lattice<3>&, const std::vector<PatchId>&,
                                             const std::vector<std::int64_t>&, int, Partition, const std::vector<int>&);

}  // namespace cairn
