#pragma once
/// Copies of shapes' files beside the results: their names hold the checksum of their bytes, which says whose they are.

#include <string>

#include "posix_file.hpp"

namespace cairn::reading {

inline constexpr const char* shape_copy = "case_shape_";

/// "case_shape_0123456789abcdef.stl"
std::string copy_name(const std::filesystem::path& file, std::uint64_t checksum);

/// Checksum of all bytes of a file; false where it cannot be read.
bool checksum_of(const PosixFile& file, std::uint64_t& sum);

/// Whether the file has the bytes that its name says.
bool is_shape_copy(const std::string& name, const PosixFile& file);

}  // namespace cairn::reading
