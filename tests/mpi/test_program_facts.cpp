#include <gtest/gtest.h>

#include <cstdlib>

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

/// A program for one instruction set alone cannot take another; also where one rank alone is asked to.
TEST(ProgramFacts, AnotherInstructionSetIsNotTakenSilently) {
  const Ranks ranks;
  const bool here = ranks.rank == ranks.size - 1;
  if (here) setenv("CAIRN_ISA", "another", 1);
  const std::string refused = program_disagreement(MPI_COMM_WORLD);
  if (here) setenv("CAIRN_ISA", program_facts().instruction_set.c_str(), 1);
  const std::string its_own = program_disagreement(MPI_COMM_WORLD);
  if (here) unsetenv("CAIRN_ISA");
  EXPECT_NE(refused.find("CAIRN_ISA=another"), std::string::npos) << refused;
  EXPECT_EQ(its_own, "");
}

}  // namespace
}  // namespace cairn
