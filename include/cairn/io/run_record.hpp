#pragma once
/// run.json: which program made the results of a folder, where and when, run by run.

#include <filesystem>
#include <string>

#include "cairn/parallel/communicator.hpp"

namespace cairn {

/// How run.json begins.
inline constexpr const char* record_mark = "{\n  \"written_by\": \"cairn\",\n  \"runs\": [\n";

/// The entry of one run. Nothing is written before `begin`; a run that was killed has no `end`.
class RunRecord {
 public:
  /// `command`: with --restart and all. Collective.
  RunRecord(std::filesystem::path out, std::string command, MPI_Comm comm);

  /// Writes the entry, behind those of the runs that this one goes on from. Returns an error or "". Rank 0 only.
  std::string begin(bool goes_on, std::int64_t step);
  /// Writes when and how the run ended; does nothing before `begin`. Returns an error or "". Rank 0 only.
  std::string end(int exit_code);

 private:
  std::string entry() const;
  std::filesystem::path file_;
  std::string command_, hosts_, before_, start_, end_;
  int ranks_ = 1, exit_code_ = 0;
  std::int64_t step_ = -1;  // the first; -1 before `begin`
};

}  // namespace cairn
