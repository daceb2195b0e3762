#include <fmt/format.h>
#include <mpi.h>
#include <unistd.h>

#include "cairn/core/error.hpp"
#include "cairn/solver/run.hpp"
#include "commands.hpp"
#include "report.hpp"

namespace cairn::app {
namespace {

namespace fs = std::filesystem;

/// Makes the folder of the results; returns the folders that were made, the innermost first.
std::vector<fs::path> make_folder(const fs::path& out) {
  const auto fail = [&](std::string_view text) { throw InputError(fmt::format("--out: {}: {}", out.string(), text)); };
  std::error_code status;
  std::vector<fs::path> made;
  for (fs::path p = fs::absolute(out).lexically_normal(); !p.empty() && !fs::exists(p, status); p = p.parent_path())
    if (p.has_filename()) made.push_back(p);
  if (made.empty() && !fs::is_directory(out)) fail("is not a folder; choose another name");
  fs::create_directories(out, status);
  if (!fs::is_directory(out)) fail(fmt::format("the folder cannot be made ({}); choose another", status.message()));
  if (access(out.c_str(), W_OK | X_OK) != 0) fail("the folder cannot be written to; choose another");
  return made;
}

}  // namespace

int command_run(const RunArguments& arguments) {
  Case c;
  if (const int code = settle(attempt([&] { c = read_case(arguments.file, arguments.overrides); }))) return code;
  print_warnings(c.warnings);

  RunSettings settings{arguments.out, arguments.restart, arguments.profile};
  if (settings.out.empty()) settings.out = arguments.file.stem();
  std::vector<fs::path> made;
  if (const int code = on_first_rank([&] { made = make_folder(settings.out); })) return code;

  int code = done;
  if (const int error = settle(attempt([&] { code = run_case(c, settings, MPI_COMM_WORLD); }))) code = error;
  std::error_code ignored;
  if (code == wrong_input)
    for (const auto& folder : made) fs::remove(folder, ignored);  // removes empty folders only
  return code;
}

}  // namespace cairn::app
