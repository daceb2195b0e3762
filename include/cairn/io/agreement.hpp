#pragma once
/// One error report for all ranks: an error that only some ranks saw becomes the same exception on every rank.

#include <mpi.h>

#include <string>

namespace cairn {

/// The message of the lowest rank whose `local_error` is not empty, on every rank; empty if no rank has one.
/// Collective.
std::string common_error(MPI_Comm comm, const std::string& local_error);

/// Does nothing where `local_error` is empty on every rank. Collective.
/// \throws RunError with common_error() on every rank otherwise.
void throw_together(MPI_Comm comm, const std::string& local_error);

}  // namespace cairn
