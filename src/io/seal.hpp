#pragma once
/// The seal of a file: its length and checksum in 40 bytes after its end, where HDF5 does not look. It is checked
/// before HDF5 opens the file, because damaged structures can make that library crash or loop.

#include <mpi.h>

#include <filesystem>
#include <string>

namespace cairn {

/// Reads the file back, each rank a part, and appends its seal. Returns what went wrong, the same on every rank; empty
/// if nothing did. Collective.
std::string seal(const std::filesystem::path& file, MPI_Comm comm);

/// What is wrong with a sealed file, the same on every rank; empty if it is whole. Collective.
std::string check_seal(const std::filesystem::path& file, MPI_Comm comm);

}  // namespace cairn
