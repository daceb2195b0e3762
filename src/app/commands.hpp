#pragma once
/// The commands of the program. Each returns its exit code, the same on every rank, and has reported its errors.

#include <filesystem>
#include <string>
#include <vector>

#include "cairn/io/case.hpp"

namespace cairn::app {

/// Exit codes.
enum Exit { done = 0, wrong_input = 2, failed = 3, stopped = 4 };

struct RunArguments {
  std::filesystem::path file, out;
  std::vector<Override> overrides;
  std::string program;  // as it was called
  std::string restart;
  bool profile = false, overwrite = false, allow_changes = false, explain = false;
};

struct PackArguments {
  std::filesystem::path spec, out;
};

int command_run(const RunArguments& arguments);
int command_check(const std::filesystem::path& file, const std::vector<Override>& overrides);
int command_info(const std::filesystem::path& file);
int command_pack(const PackArguments& arguments);
/// Writes a commented first case; the file must not be there.
int command_init(const std::filesystem::path& file);
/// Explains the keys of the case file that hold the pattern; lists all where it is empty.
int command_keys(const std::string& pattern);

/// Version, commit, compiler, libraries and instruction set.
std::string version_text();

}  // namespace cairn::app
