#pragma once
/// What comes with the program: its scripts and its manual, in the installed tree or in the source tree.

#include <filesystem>
#include <span>
#include <string>

namespace cairn::app {

struct Tool {
  const char *name, *purpose;
};
/// Scripts that `cairn NAME ...` starts.
std::span<const Tool> tools();

/// Becomes the script where argv[1] names one. Returns where it names none; ends the process with an error where the
/// script is not to be found. Call before MPI_Init.
void become_tool(int argc, char** argv);

/// Where the pages of the manual lie.
std::string manual();

}  // namespace cairn::app
