#include <fmt/format.h>
#include <mpi.h>
#include <unistd.h>

#include "cairn/core/error.hpp"
#include "cairn/io/result_files.hpp"
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

/// Refuses a folder that holds the results of another run.
void check_free(const fs::path& out) {
  const auto results = find_results(out);
  if (results.empty()) return;
  throw InputError(
      fmt::format("--out: {}: holds results already ({}{}); choose another folder, or add --overwrite to "
                  "remove them",
                  out.string(), results[0].filename().string(),
                  results.size() > 1 ? fmt::format(" and {} more", results.size() - 1) : ""));
}

/// A word as a shell reads it back.
std::string quoted(const std::string& word) {
  constexpr std::string_view plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+./=:,@%";
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

/// The command of this run without --restart, with a space at its end.
std::string command_line(const RunArguments& arguments, const fs::path& out) {
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  std::string text = ranks > 1 ? fmt::format("mpirun -n {} ", ranks) : "";
  text += fmt::format("{} run {} --out {} ", quoted(arguments.program), quoted(arguments.file.string()),
                      quoted(out.string()));
  for (const auto& [key, value] : arguments.overrides) text += fmt::format("--set {} ", quoted(key + "=" + value));
  return text;
}

}  // namespace

int command_run(const RunArguments& arguments) {
  Case c;
  if (const int code = settle(attempt([&] { c = read_case(arguments.file, arguments.overrides); }))) return code;
  print_warnings(c.warnings);

  RunSettings settings;
  settings.out = arguments.out.empty() ? arguments.file.stem() : arguments.out;
  settings.restart = arguments.restart;
  settings.profile = arguments.profile, settings.overwrite = arguments.overwrite;
  settings.allow_changes = arguments.allow_changes;
  settings.command = command_line(arguments, settings.out);
  std::vector<fs::path> made;
  const auto prepare = [&] {
    if (settings.overwrite && !settings.restart.empty())
      throw InputError("--overwrite: would remove what --restart goes on from; give one of the two");
    if (!settings.overwrite && settings.restart.empty()) check_free(settings.out);
    made = make_folder(settings.out);
  };
  if (const int code = on_first_rank(prepare)) return code;

  int code = done;
  if (const int error = settle(attempt([&] { code = run_case(c, settings, MPI_COMM_WORLD); }))) code = error;
  std::error_code ignored;
  if (code == wrong_input)
    for (const auto& folder : made) fs::remove(folder, ignored);  // removes empty folders only
  return code;
}

}  // namespace cairn::app
