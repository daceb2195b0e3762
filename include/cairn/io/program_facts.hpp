#pragma once
/// What this program is, as --version, run.json and the result files say it.

#include <mpi.h>

#include <string>

namespace cairn {

struct ProgramFacts {
  std::string version;
  std::string commit;  // of the source; "+" behind it: with changes; "unknown" where it was no git clone
  std::string compiler;
  std::string instruction_set;  // "x86-64-v3", or "native" with its widest vectors
  std::string mpi, hdf5, metis;
};

const ProgramFacts& program_facts();

/// What keeps the ranks from giving one result, the one asked for: programs of other versions or instruction sets, by
/// machine, or of another one than CAIRN_ISA names. Empty where they agree. The same on every rank. Collective.
std::string program_disagreement(MPI_Comm comm, const ProgramFacts& facts = program_facts());

}  // namespace cairn
