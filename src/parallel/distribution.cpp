#include "cairn/parallel/distribution.hpp"

#include <metis.h>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

/// Adjacency of the patches in METIS's form; edges weigh as many nodes as the two patches share.
struct Graph {
  std::vector<idx_t> starts{0}, neighbours, edge_weights, vertex_weights;
};

template <int Dim>
Graph build_graph(const Lattice<Dim>& lattice, const std::vector<std::int64_t>& work) {
  Graph graph;
  // METIS adds weights in idx_t: scale so that sums stay far from its range. One more for each patch spreads empty
  // ones.
  std::int64_t total = 0;
  for (auto w : work) total += w;
  const std::int64_t unit = 1 + total / (std::int64_t{1} << 28);
  for (int patch = 0; patch < lattice.patch_count(); ++patch) {
    std::vector<std::pair<int, std::size_t>> shared;
    for (const auto& link : lattice.links(patch)) {
      if (link.patch == patch) continue;
      const auto nodes =
          intersection(lattice.patch_nodes(patch), lattice.patch_nodes(link.patch).shifted(link.shift)).size();
      if (!shared.empty() && shared.back().first == link.patch)
        shared.back().second += nodes;
      else
        shared.emplace_back(link.patch, nodes);
    }
    for (const auto& [neighbour, nodes] : shared) {
      graph.neighbours.push_back(neighbour);
      graph.edge_weights.push_back(static_cast<idx_t>(nodes));
    }
    graph.starts.push_back(static_cast<idx_t>(graph.neighbours.size()));
    graph.vertex_weights.push_back(static_cast<idx_t>(1 + work[patch] / unit));
  }
  return graph;
}

}  // namespace

template <int Dim>
std::vector<int> distribute_patches(const Lattice<Dim>& lattice, const std::vector<std::int64_t>& work, int ranks,
                                    Partition partition) {
  const int patches = lattice.patch_count();
  std::vector<int> owner(patches, 0);
  if (ranks == 1) return owner;
  if (partition == Partition::round_robin || patches <= ranks) {
    for (int p = 0; p < patches; ++p) owner[p] = p % ranks;
    return owner;
  }
  Graph graph = build_graph(lattice, work);
  idx_t vertices = patches, constraints = 1, parts = ranks, cut = 0;
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  options[METIS_OPTION_UFACTOR] = 20;  // imbalance up to 1.02
  std::vector<idx_t> part(patches, 0);
  const auto method = ranks <= 8 ? METIS_PartGraphRecursive : METIS_PartGraphKway;
  const int status =
      method(&vertices, &constraints, graph.starts.data(), graph.neighbours.data(), graph.vertex_weights.data(),
             nullptr, graph.edge_weights.data(), &parts, nullptr, nullptr, options, &cut, part.data());
  if (status != METIS_OK) throw RunError("METIS could not partition the patches");
  std::copy(part.begin(), part.end(), owner.begin());
  return owner;
}

template std::vector<int> distribute_patches(const Lattice<2>&, const std::vector<std::int64_t>&, int, Partition);
template std::vector<int> distribute_patches(const Lattice<3>&, const std::vector<std::int64_t>&, int, Partition);

}  // namespace cairn
