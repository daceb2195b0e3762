#pragma once
/// Going on from a checkpoint: which one, whether it fits the case, and what it finds in the folder of the results.

#include <memory>

#include "cairn/solver/checkpoint.hpp"
#include "cairn/solver/run.hpp"

namespace cairn {

/// The checkpoint that the settings ask for, checked against the case and the folder; none without --restart. Says on
/// rank 0 what it goes on from and which keys of the case changed. Changes nothing on disk. Collective.
/// \throws InputError on every rank
std::unique_ptr<Checkpoint> open_restart(const Case& c, const RunSettings& settings, MPI_Comm comm);

/// Removes the results that are later than a checkpoint; the run makes them again. Returns the first error, empty if
/// there was none. Not collective.
std::string remove_later(const std::filesystem::path& out, const RunState& state,
                         const std::filesystem::path& checkpoint);

/// Removes all but the last `keep` checkpoints of a folder. Not collective.
void keep_last(const std::filesystem::path& out, int keep);

}  // namespace cairn
