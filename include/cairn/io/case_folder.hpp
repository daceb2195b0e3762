#pragma once
/// The case beside its results: case.toml and copies of the grain tables, which run again from wherever the folder is.

#include <filesystem>
#include <string>

#include "cairn/io/case.hpp"

namespace cairn {

/// What keeps a run of the case from leaving its results in the folder `out`, as "FILE: reason": a file under one of
/// the names that this program did not write, or one that the case itself reads. Empty if nothing does. Not collective.
std::string check_targets(const Case& c, const std::filesystem::path& out);

/// Writes case.toml and the tables it reads; returns the error, empty if none. Not collective.
std::string write_case_files(const Case& c, const std::filesystem::path& out);

}  // namespace cairn
