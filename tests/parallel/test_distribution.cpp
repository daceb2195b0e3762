// Who holds which patch: everything dealt out, evenly, and the same every time.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "../support/lattices.hpp"
#include "../support/random.hpp"
#include "cairn/parallel/balance.hpp"
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

/// Equal work, connected along the curve, and cuts that stay where they are nearly right.
template <int Dim>
void check_curve(const Lattice<Dim>& lattice) {
  const auto count = static_cast<std::size_t>(lattice.patch_count());
  Random random;
  std::vector<std::int64_t> work;
  for (std::size_t p = 0; p < count; ++p) work.push_back(random.integer(500, 1500));
  const auto patches = all_patches(lattice);
  for (int ranks : {2, 3, 7, 16}) {
    const auto first = distribute(lattice, work, ranks, Partition::curve);
    const auto sum = loads(first, work, ranks);
    const double mean = static_cast<double>(std::accumulate(work.begin(), work.end(), std::int64_t{0})) / ranks;
    EXPECT_LE(*std::ranges::max_element(sum), mean + 1501) << ranks << " ranks";
    EXPECT_GE(*std::ranges::min_element(sum), mean - 1501) << ranks << " ranks";
    // Noise of a hundredth moves nothing where cuts are anchored.
    auto noisy = work;
    for (auto& w : noisy) w += w * random.integer(-10, 10) / 1000;
    EXPECT_EQ(distribute_patches(lattice, patches, noisy, ranks, Partition::curve, first), first);
    // Twice the work in the first rank's patches moves cuts, and the loads are even again.
    for (std::size_t p = 0; p < count; ++p) noisy[p] *= first[p] == 0 ? 2 : 1;
    const auto second = distribute_patches(lattice, patches, noisy, ranks, Partition::curve, first);
    const auto after = loads(second, noisy, ranks);
    const double new_mean = static_cast<double>(std::accumulate(noisy.begin(), noisy.end(), std::int64_t{0})) / ranks;
    EXPECT_LE(*std::ranges::max_element(after), 1.1 * new_mean + 3000) << ranks << " ranks";
  }
}
TEST(Distribution, TheCurveIsCutEvenlyAndItsCutsStay) {
  check_curve(lattice_of<2>({128, 128}, {false, false}, 4));
  check_curve(lattice_of<3>({40, 40, 40}, {true, false, false}, 4));
}

TEST(Distribution, OneHeavyPatchLeavesPatchesForAllRanks) {
  const auto lattice = lattice_of<2>({40, 40}, {false, false}, 4);
  for (std::size_t heavy : {0u, 37u, 99u}) {
    std::vector<std::int64_t> work(100, 1);
    work[heavy] = 1'000'000;
    const auto owner = distribute(lattice, work, 9, Partition::curve);
    EXPECT_EQ(std::set<int>(owner.begin(), owner.end()).size(), 9u);
  }
}

/// More patches than METIS is asked to part on every rank.
TEST(Distribution, ManyPatchesAreCutAlongTheCurve) {
  const auto lattice = lattice_of<2>({800, 800}, {false, false}, 4);
  ASSERT_GT(lattice.patch_count(), most_for_metis);
  const std::vector<std::int64_t> work(lattice.patch_count(), 64);
  EXPECT_EQ(distribute(lattice, work, 1000, Partition::metis), distribute(lattice, work, 1000, Partition::curve));
}

/// The naive way: the largest overlap of all, again and again.
TEST(Balance, PartsStayWhereMostOfThemIs) {
  Random random;
  for (int ranks : {1, 2, 5, 12}) {
    std::vector<int> parts, owner;
    std::vector<std::int64_t> work;
    for (int p = 0; p < 40; ++p) {
      parts.push_back(random.integer(0, ranks - 1)), owner.push_back(random.integer(0, ranks - 1));
      work.push_back(random.integer(0, 100));
    }
    std::vector<int> rank_of(ranks, -1);
    std::set<int> taken;
    for (int round = 0; round < ranks; ++round) {
      std::int64_t most = -1;
      std::pair<int, int> best;
      for (int part = 0; part < ranks; ++part)
        for (int rank = 0; rank < ranks; ++rank) {
          if (rank_of[part] >= 0 || taken.contains(rank)) continue;
          std::int64_t sum = 0;
          for (std::size_t p = 0; p < parts.size(); ++p)
            if (parts[p] == part && owner[p] == rank) sum += 1 + work[p];
          if (sum > most) most = sum, best = {part, rank};
        }
      rank_of[best.first] = best.second, taken.insert(best.second);
    }
    const auto renamed = keep_in_place(parts, owner, work, ranks);
    for (std::size_t p = 0; p < parts.size(); ++p) EXPECT_EQ(renamed[p], rank_of[parts[p]]);
  }
}

/// Memory and time follow the patches, not the square of the ranks: a table of all pairs would take 240 GB here.
TEST(Balance, ManyRanks) {
  constexpr int ranks = 100'000;
  std::vector<int> parts, owner;
  for (int p = 0; p < 2 * ranks; ++p) parts.push_back(p / 2), owner.push_back((p / 2 + 7) % ranks);
  const auto renamed = keep_in_place(parts, owner, std::vector<std::int64_t>(parts.size(), 10), ranks);
  EXPECT_EQ(renamed, owner);
}

TEST(Distribution, RoundRobinDealsOutInTurn) {
  const auto lattice = lattice_of<2>({20, 12}, {true, false}, 4);
  const auto owner = distribute(lattice, std::vector<std::int64_t>(15, 1), 4, Partition::round_robin);
  ASSERT_EQ(owner.size(), 15u);
  for (int p = 0; p < 15; ++p) EXPECT_EQ(owner[p], p % 4);
}

TEST(Distribution, FewPatchesGoToOneRankEach) {
  const auto lattice = lattice_of<2>({8, 8}, {true, true}, 4);
  for (Partition partition : {Partition::metis, Partition::curve, Partition::round_robin})
    for (int ranks : {4, 5, 9}) {
      const auto owner = distribute(lattice, std::vector<std::int64_t>(4, 10), ranks, partition);
      EXPECT_EQ(std::set<int>(owner.begin(), owner.end()).size(), 4u);
      for (int rank : owner) EXPECT_LT(rank, ranks);
    }
}

TEST(Distribution, OneRankHoldsAll) {
  const auto lattice = lattice_of<2>({20, 12}, {true, false}, 4);
  for (Partition partition : {Partition::metis, Partition::curve, Partition::round_robin})
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
