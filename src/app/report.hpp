#pragma once
/// One error report whatever the rank count, and never a hang.
///
/// Work that may throw runs inside `attempt`; all ranks then meet in `settle`. If the failing ranks are met there by
/// all others, the lowest failing rank prints and every rank gets its exit code. If the others do not come within a
/// time limit, they wait for the failing rank somewhere in the work: the lowest that failed prints and aborts the run.

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cairn::app {

struct Failure {
  int code;            // exit code
  std::string text;    // the whole report
  bool alone = false;  // the other ranks are known to wait in the work
};

int rank();

/// Sees to it that a rank that runs out of memory ends the job. Call after MPI_Init.
void prepare_for_failures();

/// Runs the work; a thrown exception becomes a failure.
std::optional<Failure> attempt(const std::function<void()>& work);

/// The common exit code: 0 if no rank failed. Collective over all ranks.
int settle(const std::optional<Failure>& failure);

/// attempt and settle for work of rank 0 alone.
int on_first_rank(const std::function<void()>& work);

/// Prints "warning: ..." lines on rank 0.
void print_warnings(const std::vector<std::string>& warnings);

}  // namespace cairn::app
