// The maximum over all ranks that is found while other work is done, and what becomes of it when a rank fails
// meanwhile.

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "../support/world.hpp"
#include "cairn/parallel/communicator.hpp"

namespace cairn {
namespace {

double rank_of_world() {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

TEST(MaximumReductionOnRanks, FindsTheLargestOfEachNumber) {
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const double rank = rank_of_world();
  MaximumReduction maxima(3);
  EXPECT_FALSE(maxima.under_way());
  maxima.start(std::array{rank, -rank, 7.0}, MPI_COMM_WORLD);
  EXPECT_TRUE(maxima.under_way());
  maxima.finish();
  EXPECT_EQ(maxima[0], ranks - 1);
  EXPECT_EQ(maxima[1], 0);
  EXPECT_EQ(maxima[2], 7);
}

/// Rank 0 fails on its own and leaves after a second; the others come later, and find what it gave them.
TEST(MaximumReductionOnRanks, IsLeftByARankThatFailsAlone) {
  using Clock = std::chrono::steady_clock;
  MPI_Comm comm = MPI_COMM_NULL;
  MPI_Comm_dup(MPI_COMM_WORLD, &comm);
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  const double rank = rank_of_world();
  const auto begin = Clock::now();
  if (rank > 0) std::this_thread::sleep_for(std::chrono::seconds(3));
  try {
    MaximumReduction maxima(1);
    maxima.start(std::array{5.0 - rank}, comm);
    if (rank == 0) throw std::runtime_error("of this rank alone");
    maxima.finish();
    EXPECT_EQ(maxima[0], 5);
  } catch (const std::runtime_error&) {
    EXPECT_EQ(rank, 0);
    EXPECT_LT(Clock::now() - begin, std::chrono::milliseconds(2500));
  }
  MPI_Barrier(MPI_COMM_WORLD);
  MPI_Comm_free(&comm);
}

}  // namespace
}  // namespace cairn
