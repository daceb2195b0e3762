// In the place of src/solver/timers.cpp: a program whose stages fail on one rank, as CAIRN_FAIL="RANK STAGE COUNT KIND"
// says: at the COUNT-th time that the stage begins there, with an exception of that kind.
// It says when.

#include "cairn/solver/timers.hpp"

#include <mpi.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <sstream>
#include <string>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

struct Plan {
  int rank = -1, count = 0;
  std::string stage, kind;
};

Plan read_plan() {
  Plan plan;
  if (const char* text = std::getenv("CAIRN_FAIL"))
    std::istringstream(text) >> plan.rank >> plan.stage >> plan.count >> plan.kind;
  return plan;
}

[[noreturn]] void fail(const std::string& kind) {
  constexpr const char* text = "made to fail";
  std::fprintf(
      stderr, "failing at %.3f\n",
      static_cast<double>(std::chrono::system_clock::now().time_since_epoch() / std::chrono::milliseconds(1)) / 1e3);
  if (kind == "RunError") throw RunError(text);
  if (kind == "InputError") throw InputError(text);
  if (kind == "bad_alloc") throw std::bad_alloc();
  throw std::runtime_error(text);
}

}  // namespace

StageTimers::Scope StageTimers::measure(Stage stage) {
  static Plan plan = read_plan();
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank == plan.rank && plan.stage == stage_names[static_cast<std::size_t>(stage)] && --plan.count == 0)
    fail(plan.kind);
  return {*this, stage};
}

}  // namespace cairn
