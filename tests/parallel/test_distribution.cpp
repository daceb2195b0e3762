// Who holds which patch: everything dealt out, evenly, and the same every time.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "../support/lattices.hpp"
#include "../support/random.hpp"
#include "cairn/parallel/distribution.hpp"

namespace cairn {
namespace {

using namespace test;

/// All patches of a lattice dealt out.
template <int Dim>
std::vector<int> distribute(const Lattice<Dim>& lattice, const std::vector<std::int64_t>& work, int ranks,
                            Partition partition) {
  return distribute_patches(lattice, all_patches(lattice), work, ranks, partition);
}

/// Work of each rank.
std::vector<std::int64_t> loads(const std::vector<int>& owner, const std::vector<std::int64_t>& work, int ranks) {
  std::vector<std::int64_t> sum(ranks, 0);
  for (std::size_t p = 0; p < owner.size(); ++p) sum.at(owner[p]) += work[p];
  return sum;
}

template <int Dim>
void check_metis(const Lattice<Dim>& lattice, const std::vector<std::int64_t>& work, double imbalance) {
  const double total = static_cast<double>(std::accumulate(work.begin(), work.end(), std::int64_t{0}));
  for (int ranks : {1, 2, 3, 4, 7, 8, 12}) {
    const auto owner = distribute(lattice, work, ranks, Partition::metis);
    ASSERT_EQ(std::ssize(owner), lattice.patch_count());
    const auto sum = loads(owner, work, ranks);  // throws for a rank that does not exist
    EXPECT_LE(*std::max_element(sum.begin(), sum.end()), imbalance * total / ranks) << ranks << " ranks";
    EXPECT_GT(*std::min_element(sum.begin(), sum.end()), 0) << ranks << " ranks";
    EXPECT_EQ(distribute(lattice, work, ranks, Partition::metis), owner);
  }
}
TEST(Distribution, MetisBalancesUniformWork) {
  const auto flat = lattice_of<2>({80, 80}, {false, true}, 4);
  check_metis(flat, std::vector<std::int64_t>(flat.patch_count(), 64), 1.1);
  const auto solid = lattice_of<3>({32, 32, 32}, {true, false, false}, 4);
  check_metis(solid, std::vector<std::int64_t>(solid.patch_count(), 512), 1.1);
}

TEST(Distribution, MetisBalancesUnevenWork) {
  const auto lattice = lattice_of<2>({80, 80}, {false, false}, 4);
  Random random;
  std::vector<std::int64_t> work;
  for (int p = 0; p < lattice.patch_count(); ++p) work.push_back(p % 3 == 0 ? 0 : random.integer(1, 2000));
  check_metis(lattice, work, 1.15);
  // So much work that its sum would overflow 32 bits.
  for (auto& w : work) w *= 1'000'000;
  check_metis(lattice, work, 1.15);
}

/// Connected parts share fewer nodes between ranks than dealing out in turn does.
TEST(Distribution, MetisCutsLessThanDealingOut) {
  const auto lattice = lattice_of<2>({64, 64}, {false, false}, 4);
  const std::vector<std::int64_t> work(lattice.patch_count(), 64);
  const auto cut = [&](Partition partition) {
    const auto owner = distribute(lattice, work, 4, partition);
    int links = 0;
    for (int p = 0; p < lattice.patch_count(); ++p)
      for (const auto& link : lattice.links(p)) links += owner[link.patch] != owner[p];
    return links;
  };
  EXPECT_LT(3 * cut(Partition::metis), cut(Partition::round_robin));
}

TEST(Distribution, RoundRobinDealsOutInTurn) {
  const auto lattice = lattice_of<2>({20, 12}, {true, false}, 4);
  const auto owner = distribute(lattice, std::vector<std::int64_t>(15, 1), 4, Partition::round_robin);
  ASSERT_EQ(owner.size(), 15u);
  for (int p = 0; p < 15; ++p) EXPECT_EQ(owner[p], p % 4);
}

TEST(Distribution, FewPatchesGoToOneRankEach) {
  const auto lattice = lattice_of<2>({8, 8}, {true, true}, 4);
  for (Partition partition : {Partition::metis, Partition::round_robin})
    for (int ranks : {4, 5, 9}) {
      const auto owner = distribute(lattice, std::vector<std::int64_t>(4, 10), ranks, partition);
      EXPECT_EQ(std::set<int>(owner.begin(), owner.end()).size(), 4u);
      for (int rank : owner) EXPECT_LT(rank, ranks);
    }
}

TEST(Distribution, OneRankHoldsAll) {
  const auto lattice = lattice_of<2>({20, 12}, {true, false}, 4);
  for (Partition partition : {Partition::metis, Partition::round_robin})
    EXPECT_EQ(distribute(lattice, std::vector<std::int64_t>(15, 1), 1, partition), std::vector<int>(15, 0));
}

/// A table of two far places in a domain of 10^12 cells and more.
template <int Dim>
void check_table(const Lattice<Dim>& lattice) {
  Index<Dim> low{}, high = lattice.cells();
  for (int d = 0; d < Dim; ++d) low[d] = 3, high[d] -= 9;
  const std::vector<PatchId> filled = {lattice.patch_of_cell(low), lattice.patch_of_cell(high)};
  PatchTable<Dim> table(lattice, filled);
  EXPECT_LE(table.size(), 2 * std::pow(3, Dim));
  EXPECT_TRUE(std::ranges::is_sorted(table.patches()));
  for (const PatchId patch : filled) {
    EXPECT_TRUE(table.is_filled(patch));
    for (const auto& link : lattice.links(patch)) {
      EXPECT_GE(table.find(link.patch), 0);
      EXPECT_TRUE(!table.is_filled(link.patch) || std::ranges::find(filled, link.patch) != filled.end());
    }
  }
  constexpr int ranks = 3;
  const std::vector<std::int64_t> work(table.size(), 1);
  const auto owners = distribute_patches(lattice, table.patches(), work, ranks, Partition::round_robin);
  table.assign(owners);
  EXPECT_EQ(table.owners(), owners);
  // A point goes from patch to patch through the empty middle: the owner of each is known before and stays.
  std::size_t added = 0;
  for (int i = 1; i < 40; ++i) {
    Index<Dim> cell = low;
    for (int d = 0; d < Dim; ++d) cell[d] += i * 70;
    const PatchId patch = lattice.patch_of_cell(cell);
    const int owner = table.owner(patch);
    EXPECT_TRUE(owner >= 0 && owner < ranks);
    added += table.fill({patch, patch}).size();
    EXPECT_TRUE(table.is_filled(patch));
    EXPECT_EQ(table.owner(patch), owner);
    EXPECT_TRUE(table.fill({patch}).empty());
  }
  EXPECT_EQ(table.size(), owners.size() + added);
  const std::vector<int> before = table.owners();
  table.assign(before);
  EXPECT_EQ(table.owners(), before);
}
TEST(PatchTable, HoldsPatchesWithinReachAndKnowsWhoseTheOthersAre) {
  check_table(lattice_of<2>({1'000'000, 1'000'000}, {false, true}, 64));
  check_table(lattice_of<3>({1'000'000, 1'000'000, 1'000'000}, {true, false, false}, 4));
}

}  // namespace
}  // namespace cairn
