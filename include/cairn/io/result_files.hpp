#pragma once
/// The files in which a run leaves its results, so that none are overwritten unasked.

#include <filesystem>
#include <string>
#include <vector>

namespace cairn {

/// True for the names of result files: history.csv, bodies.csv, particles_N.vtkhdf, grains_N.h5, contacts_N.h5 and
/// checkpoint_N.h5 with N a number, and indices of series, *.hdf.series. The case as it was run, case.toml, is none.
bool is_result_name(const std::string& name);

/// The result files in `folder`, sorted; none if there is no such folder. Not collective.
/// \throws InputError if the folder cannot be read.
std::vector<std::filesystem::path> find_results(const std::filesystem::path& folder);

/// Removes exactly the result files in `folder`; returns the first error, empty if there was none. Not collective.
std::string remove_results(const std::filesystem::path& folder);

}  // namespace cairn
