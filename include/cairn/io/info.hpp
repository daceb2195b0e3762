#pragma once
/// What a result file holds, in words.

#include <filesystem>
#include <string>

namespace cairn {

/// Kind, time, step, number of rows, and each dataset with its shape, type, unit and range of values; ends with a
/// newline. Reads every value once, with little memory. Not collective: one rank asks.
/// \throws InputError if there is no such file, or it is no HDF5 file, or it is damaged or cut short.
std::string describe_file(const std::filesystem::path& file);

}  // namespace cairn
