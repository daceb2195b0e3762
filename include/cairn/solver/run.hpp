#pragma once
/// A whole run of a case: set-up or restart, stepping, output.

#include <filesystem>
#include <string>

#include "cairn/io/case.hpp"
#include "cairn/io/run_record.hpp"
#include "cairn/parallel/communicator.hpp"

namespace cairn {

struct RunSettings {
  std::filesystem::path out;    // folder of the results; exists
  std::string restart;          // empty: from the start; "latest": the last checkpoint in `out`; else a checkpoint file
  bool profile = false;         // report where the time went
  bool allow_changes = false;   // go on from a checkpoint of a case that differs
  std::string command;          // of this run without --restart, for the message that says how to resume
  RunRecord* record = nullptr;  // where it is kept, of rank 0
  bool overwrite = false;       // remove the results of an earlier run from `out`, once the case has been set up
};

/// Runs the case. Collective. Returns the exit code: 0 done, 4 stopped by a signal after a checkpoint.
/// \throws InputError when the restart does not fit the case, RunError when the run fails (on every rank); RankError,
/// or whatever set-up threw, on a rank that failed alone: then the others wait for it, and the job has to be ended.
int run_case(Case c, const RunSettings& settings, MPI_Comm comm);

/// Prints the stages of a step of the case, and what patches send between them, counted in its second step. Collective.
/// \throws InputError, RunError as run_case
void explain_step(const Case& c, MPI_Comm comm);

}  // namespace cairn
