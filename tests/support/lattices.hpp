#pragma once
/// Lattices of several shapes for property tests: every choice of periodic directions, patches that do not divide the
/// cells evenly, periodic directions one and two patches wide.

#include <numeric>
#include <type_traits>
#include <vector>

#include "cairn/grid/lattice.hpp"

namespace cairn::test {

template <int Dim>
Lattice<Dim> lattice_of(const Index<Dim>& cells, const std::array<bool, Dim>& periodic, int patch_cells) {
  const Vec3 lower(-0.3, 1.7, 0.4), spacing(0.1, 0.13, 0.07);
  Vec<Dim> a, b;
  for (int d = 0; d < Dim; ++d) a[d] = lower[d], b[d] = lower[d] + cells[d] * spacing[d];
  return Lattice<Dim>(a, b, cells, periodic, patch_cells);
}

template <int Dim>
std::vector<Lattice<Dim>> all_lattices() {
  std::vector<Index<Dim>> sizes;
  if constexpr (Dim == 2)
    sizes = {{13, 11}, {5, 5}, {9, 4}, {4, 17}, {8, 8}};
  else
    sizes = {{9, 8, 5}, {4, 4, 4}, {13, 4, 8}};
  std::vector<Lattice<Dim>> lattices;
  for (const auto& cells : sizes)
    for (int choice = 0; choice < 1 << Dim; ++choice) {
      std::array<bool, Dim> periodic;
      for (int d = 0; d < Dim; ++d) periodic[d] = (choice >> d) & 1;
      lattices.push_back(lattice_of<Dim>(cells, periodic, 4));
    }
  return lattices;
}

template <int Dim>
std::vector<PatchId> all_patches(const Lattice<Dim>& lattice) {
  std::vector<PatchId> all(static_cast<std::size_t>(lattice.patch_count()));
  std::iota(all.begin(), all.end(), PatchId{0});
  return all;
}

/// The node inside one period that `node` is an image of.
template <int Dim>
Index<Dim> canonical(const Lattice<Dim>& lattice, std::type_identity_t<Index<Dim>> node) {
  for (int d = 0; d < Dim; ++d)
    if (lattice.periodic(d)) node[d] = ((node[d] % lattice.cells()[d]) + lattice.cells()[d]) % lattice.cells()[d];
  return node;
}

}  // namespace cairn::test
