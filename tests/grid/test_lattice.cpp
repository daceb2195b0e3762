// The division of the lattice into patches, as properties of many lattices.

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "../support/lattices.hpp"
#include "cairn/body/patch.hpp"
#include "cairn/grid/shape_functions.hpp"

namespace cairn {
namespace {

using namespace test;

/// Calls check(lattice) for every lattice of the dimension, saying which one failed.
template <int Dim, class F>
void for_lattices(F&& check) {
  for (const auto& lattice : all_lattices<Dim>()) {
    std::string name;
    for (int d = 0; d < Dim; ++d) name += std::to_string(lattice.cells()[d]) + (lattice.periodic(d) ? "p " : " ");
    SCOPED_TRACE(name);
    check(lattice);
  }
}

template <int Dim>
void check_tiling(const Lattice<Dim>& lattice) {
  std::map<Index<Dim>, PatchId> holder;
  for (int p = 0; p < lattice.patch_count(); ++p) {
    EXPECT_EQ(lattice.patch_at(lattice.patch_position(p)), p);
    const auto cells = lattice.patch_cells(p);
    for (int d = 0; d < Dim; ++d) EXPECT_GE(cells.extent(d), 4);
    for_each(cells, [&](const Index<Dim>& cell) {
      EXPECT_TRUE(holder.emplace(cell, p).second) << "two patches hold a cell";
      EXPECT_EQ(lattice.patch_of_cell(cell), p);
    });
  }
  std::size_t total = 1;
  for (int d = 0; d < Dim; ++d) total *= lattice.cells()[d];
  EXPECT_EQ(holder.size(), total);
}
TEST(Lattice, PatchesTileTheCells) {
  for_lattices<2>(check_tiling<2>);
  for_lattices<3>(check_tiling<3>);
}

TEST(Lattice, FewerCellsThanAPatchMakeOnePatch) {
  const auto lattice = lattice_of<2>({3, 9}, {false, false}, 4);
  EXPECT_EQ(lattice.patch_count(), 2);
  EXPECT_EQ(lattice.patch_cells(0).extent(0), 3);
}

TEST(Lattice, LengthsAndPositions) {
  const Lattice<2> lattice(Vec<2>(-1, 2), Vec<2>(3, 3), {8, 5}, {false, true}, 4);
  EXPECT_DOUBLE_EQ(lattice.spacing()[0], 0.5);
  EXPECT_DOUBLE_EQ(lattice.spacing()[1], 0.2);
  EXPECT_DOUBLE_EQ(lattice.cell_volume(), 0.1);
  EXPECT_DOUBLE_EQ(lattice.smallest_spacing(), 0.2);
  EXPECT_DOUBLE_EQ(lattice.length(0), 4);
  EXPECT_DOUBLE_EQ(lattice.scaled(0, 0.25), 2.5);
  EXPECT_DOUBLE_EQ(lattice.node_position(1, -1), 1.8);
}

/// Every node that any patch knows, reduced to one period, is owned once: by one patch, at one of its images.
template <int Dim>
void check_owners(const Lattice<Dim>& lattice) {
  std::map<Index<Dim>, int> owners;
  for (int p = 0; p < lattice.patch_count(); ++p)
    for_each(lattice.patch_nodes(p),
             [&](const Index<Dim>& i) { owners[canonical(lattice, i)] += lattice.owns_node(p, i); });
  for (const auto& [node, count] : owners) EXPECT_EQ(count, 1) << node[0] << " " << node[1];
  std::size_t expected = 1;  // two nodes beyond each face
  for (int d = 0; d < Dim; ++d) expected *= lattice.cells()[d] + (lattice.periodic(d) ? 0 : 5);
  EXPECT_EQ(owners.size(), expected);
}
TEST(Lattice, EveryNodeHasOneOwner) {
  for_lattices<2>(check_owners<2>);
  for_lattices<3>(check_owners<3>);
}

/// Links pair up, and there is exactly one for every way in which two patches share nodes.
template <int Dim>
void check_links(const Lattice<Dim>& lattice) {
  Box<Dim> images;
  for (int d = 0; d < Dim; ++d) images.lower[d] = lattice.periodic(d) ? -2 : 0, images.upper[d] = -images.lower[d] + 1;
  for (int p = 0; p < lattice.patch_count(); ++p) {
    const auto links = lattice.links(p);
    std::set<std::pair<PatchId, Index<Dim>>> found, expected;
    for (std::size_t l = 0; l < links.size(); ++l) {
      EXPECT_TRUE(found.emplace(links[l].patch, links[l].shift).second) << "a link twice";
      const auto back = lattice.links(links[l].patch).at(links[l].mirror);
      EXPECT_EQ(back.patch, p);
      EXPECT_EQ(back.mirror, static_cast<int>(l));
      for (int d = 0; d < Dim; ++d) EXPECT_EQ(back.shift[d], -links[l].shift[d]);
    }
    for (int q = 0; q < lattice.patch_count(); ++q)
      for_each(images, [&](Index<Dim> shift) {
        for (int d = 0; d < Dim; ++d) shift[d] *= lattice.cells()[d];
        if (q == p && shift == Index<Dim>{}) return;
        if (!intersection(lattice.patch_nodes(p), lattice.patch_nodes(q).shifted(shift)).empty())
          expected.emplace(q, shift);
      });
    EXPECT_EQ(found, expected);
  }
}
TEST(Lattice, LinksMirrorEachOtherAndAreComplete) {
  for_lattices<2>(check_links<2>);
  for_lattices<3>(check_links<3>);
}

TEST(Lattice, OnePatchInAPeriodicDirectionIsItsOwnNeighbour) {
  const auto links = lattice_of<2>({5, 6}, {true, false}, 4).links(0);
  ASSERT_EQ(links.size(), 2u);
  for (const auto& link : links) EXPECT_EQ(link.patch, 0);
  EXPECT_EQ(links[0].shift, (Index<2>{5, 0}));  // the neighbour's own node 5 lower: first in the order of sums
  EXPECT_EQ(links[1].shift, (Index<2>{-5, 0}));
}

template <int Dim>
using Contribution = std::pair<PatchId, Index<Dim>>;  // patch, position of the node in that patch's frame

/// Who adds to a node, in the order in which a patch adds, as `Patch` prescribes it.
template <int Dim>
std::vector<Contribution<Dim>> order_of_sums(const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                             const std::type_identity_t<Index<Dim>>& i) {
  std::vector<Contribution<Dim>> order;
  for (std::size_t l = 0; l <= patch.links.size(); ++l) {
    if (static_cast<int>(l) == patch.links_before) order.emplace_back(patch.id, i);
    if (l == patch.links.size() || !patch.overlaps[l].contains(i)) continue;
    Index<Dim> theirs = i;
    for (int d = 0; d < Dim; ++d) theirs[d] -= patch.links[l].shift[d];
    EXPECT_TRUE(lattice.patch_nodes(patch.links[l].patch).contains(theirs));
    order.emplace_back(patch.links[l].patch, theirs);
  }
  return order;
}

template <int Dim>
void check_order_of_sums(const Lattice<Dim>& lattice) {
  std::map<Index<Dim>, std::vector<Contribution<Dim>>> all;  // every patch position of every node, ascending
  for (int p = 0; p < lattice.patch_count(); ++p)
    for_each(lattice.patch_nodes(p), [&](const Index<Dim>& i) { all[canonical(lattice, i)].emplace_back(p, i); });
  for (auto& [node, contributions] : all)
    std::sort(contributions.begin(), contributions.end(),
              [](auto& a, auto& b) { return a.first != b.first ? a.first < b.first : a.second < b.second; });
  for (int p = 0; p < lattice.patch_count(); ++p) {
    const Patch<Dim> patch(p, lattice);
    for_each(patch.nodes, [&](const Index<Dim>& i) {
      EXPECT_EQ(order_of_sums(patch, lattice, i), all[canonical(lattice, i)]) << "patch " << p;
    });
  }
}
TEST(Lattice, OrderOfSumsIsTheSameSeenFromEveryPatch) {
  for_lattices<2>(check_order_of_sums<2>);
  for_lattices<3>(check_order_of_sums<3>);
}

template <class Shape, int Dim>
void check_reach(const Lattice<Dim>& lattice) {
  for (int p = 0; p < lattice.patch_count(); ++p)
    for (int d = 0; d < Dim; ++d) {
      const auto nodes = lattice.patch_nodes(p);
      const auto [lower, upper] = lattice.patch_reach(p, d);
      EXPECT_LE(lower, lattice.patch_cells(p).lower[d]);
      EXPECT_GE(upper, lattice.patch_cells(p).upper[d]);
      for (int k = 0; k <= 64; ++k) {
        const double xi = std::min(lower + (upper - lower) * k / 64, std::nextafter(upper, lower));
        const int first = static_cast<int>(Shape::first_node(xi));
        EXPECT_GE(first, nodes.lower[d]);
        EXPECT_LE(first + Shape::nodes, nodes.upper[d]);
      }
    }
}
TEST(Lattice, PatchNodesHoldAllThatItsPointsTouch) {
  const auto check = [](const Lattice<2>& lattice) {
    check_reach<LinearShape>(lattice);
    check_reach<GimpShape>(lattice);
    check_reach<QuadraticShape>(lattice);
    check_reach<CellDensityShape>(lattice);
  };
  for_lattices<2>(check);
}

/// Positions within 3 rounding errors of both faces, and of a period beyond them.
TEST(Lattice, WrappedPositionsLieInside) {
  const double lengths[] = {1.2, 0.7, 0.01, 0.001, 1e-6, 3.0, 1e6};
  const double lowers[] = {0.0, -0.06, 0.01, 0.003, -0.001, -1.0, -1e-6, 1e-6, 1e6, -1e6, -0.35};
  int looked_at = 0;
  for (double lower : lowers)
    for (double length : lengths)
      for (int cells : {4, 7, 10, 48, 1000}) {
        if (std::abs(lower) > 1e9 * length) continue;  // no cell is left of the rounding
        const double upper = lower + length;
        const Lattice<2> lattice(Vec<2>(lower, 0), Vec<2>(upper, 1), {cells, 4}, {true, false}, 4);
        const double period = lattice.length(0);
        for (double face : {lower, upper, lower - 0.5 * period, upper + 0.5 * period})
          for (int ulp = -3; ulp <= 3; ++ulp) {
            double x = face;
            for (int i = 0; i < std::abs(ulp); ++i) x = std::nextafter(x, ulp < 0 ? -1e300 : 1e300);
            double wrapped = x;
            const int periods = lattice.wrap(0, wrapped);
            const double xi = lattice.scaled(0, wrapped);
            ASSERT_TRUE(xi >= 0 && xi < cells) << "lower " << lower << " length " << length << " x " << x;
            ASSERT_NEAR(wrapped + periods * period, x, 8e-16 * (std::abs(lower) + 2 * length));
            double again = wrapped;
            ASSERT_EQ(lattice.wrap(0, again), 0);
            ASSERT_EQ(again, wrapped);
            ++looked_at;
          }
      }
  EXPECT_GT(looked_at, 9000);
}

TEST(Lattice, PositionsFarOutsideAreNotWrapped) {
  const Lattice<2> lattice(Vec<2>(-1, 0), Vec<2>(3, 1), {8, 4}, {true, false}, 4);
  for (double x : {-6.0, 8.0, 1e30, -1e300, std::nan(""), std::numeric_limits<double>::infinity()}) {
    double wrapped = x;
    EXPECT_EQ(lattice.wrap(0, wrapped), 0);
    EXPECT_TRUE(wrapped == x || std::isnan(x));
  }
}

}  // namespace
}  // namespace cairn
