#include <gtest/gtest.h>

#include "cairn/io/program_facts.hpp"

namespace cairn {
namespace {

struct Ranks {
  int rank = 0, size = 1;
  Ranks() {
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
  }
};

TEST(ProgramFacts, OneProgramAgrees) { EXPECT_EQ(program_disagreement(MPI_COMM_WORLD), ""); }

TEST(ProgramFacts, EveryRankIsToldWhichTwoDiffer) {
  const Ranks ranks;
  if (ranks.size == 1) GTEST_SKIP();
  for (const auto member :
       {&ProgramFacts::instruction_set, &ProgramFacts::commit, &ProgramFacts::compiler, &ProgramFacts::version}) {
    ProgramFacts mine = program_facts();
    if (ranks.rank == ranks.size - 1) mine.*member = "another";
    const std::string text = program_disagreement(MPI_COMM_WORLD, mine);
    EXPECT_NE(text.find("another"), std::string::npos) << text;
    EXPECT_NE(text.find("(rank 0)"), std::string::npos) << text;
    EXPECT_NE(text.find("(rank " + std::to_string(ranks.size - 1) + ")"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace cairn
