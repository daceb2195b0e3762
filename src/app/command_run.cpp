#include <fmt/format.h>
#include <mpi.h>
#include <unistd.h>

#include "cairn/core/error.hpp"
#include "cairn/core/say.hpp"
#include "cairn/io/case_folder.hpp"
#include "cairn/io/folder_lock.hpp"
#include "cairn/io/own_files.hpp"
#include "cairn/io/program_facts.hpp"
#include "cairn/io/result_files.hpp"
#include "cairn/io/run_record.hpp"
#include "cairn/solver/run.hpp"
#include "commands.hpp"
#include "estimate.hpp"
#include "report.hpp"

namespace cairn::app {
namespace {

namespace fs = std::filesystem;

/// Makes the folder of the results, and adds the folders that were made to `made`, the innermost first.
void make_folder(const fs::path& out, std::vector<fs::path>& made) {
  const auto fail = [&](std::string_view text) { throw InputError(fmt::format("--out: {}: {}", out.string(), text)); };
  std::error_code status;
  std::vector<fs::path> missing;
  fs::path p = fs::absolute(out).lexically_normal();
  for (; !p.empty() && !fs::exists(p, status); p = p.parent_path()) {
    if (status) fail(fmt::format("{} cannot be looked at ({}); choose another", p.string(), status.message()));
    if (p.has_filename()) missing.push_back(p);
  }
  if (missing.empty() && !fs::is_directory(out, status)) fail("is not a folder; choose another name");
  made = missing;
  fs::create_directories(out, status);
  if (std::error_code other; !fs::is_directory(out, other))
    fail(fmt::format("the folder cannot be made ({}); choose another", status.message()));
  if (access(out.c_str(), R_OK | W_OK | X_OK) != 0) fail("the folder cannot be read and written to; choose another");
}

/// Refuses a folder that holds the results of another run.
void check_free(const fs::path& out) {
  const auto results = find_results(out);
  if (results.empty()) return;
  for (const auto& file : results)
    if (const std::string reason = foreign_result(file); !reason.empty()) throw InputError("--out: " + reason);
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

/// The command of this run without --restart and what belongs to it, with a space at its end.
std::string command_line(const RunArguments& arguments, const fs::path& out) {
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  std::string text = ranks > 1 ? fmt::format("mpirun -n {} ", ranks) : "";
  text += fmt::format("{} run {} --out {} ", quoted(arguments.program), quoted(arguments.file.string()),
                      quoted(out.string()));
  for (const auto& [key, value] : arguments.overrides)
    text += fmt::format("--set {} ", quoted(fmt::format("{}={}", key, value)));
  return text;
}

/// The whole command of this run.
std::string whole_command(const RunArguments& arguments, const RunSettings& settings) {
  std::string text = settings.command;
  if (!settings.restart.empty()) text += fmt::format("--restart {} ", quoted(settings.restart));
  for (const auto& [given, option] :
       {std::pair(settings.overwrite, "--overwrite "), std::pair(settings.allow_changes, "--allow-changes "),
        std::pair(arguments.profile, "--profile ")})
    if (given) text += option;
  text.pop_back();
  return text;
}

}  // namespace

int command_run(const RunArguments& arguments) {
  Case c;
  if (const int code = settle(attempt([&] { c = read_case(arguments.file, arguments.overrides); }))) return code;
  print_warnings(c.warnings);
  if (arguments.explain) return settle(attempt([&] { explain_step(c, MPI_COMM_WORLD); }));

  RunSettings settings;
  settings.out = arguments.out.empty() ? arguments.file.stem() : arguments.out;
  settings.restart = arguments.restart;
  settings.profile = arguments.profile, settings.overwrite = arguments.overwrite;
  settings.allow_changes = arguments.allow_changes;
  settings.command = command_line(arguments, settings.out);
  RunRecord record(settings.out, whole_command(arguments, settings), MPI_COMM_WORLD);
  settings.record = &record;
  std::vector<fs::path> made;
  FolderLock lock;  // of rank 0
  const auto prepare = [&] {
    if (settings.overwrite && !settings.restart.empty())
      throw InputError("--overwrite: would remove what --restart goes on from; give one of the two");
    make_folder(settings.out, made);
    lock = FolderLock(settings.out);
    if (!settings.overwrite && settings.restart.empty()) check_free(settings.out);
    if (const std::string reason = check_targets(c, settings.out); !reason.empty())
      throw InputError("--out: " + reason);
    const ProgramFacts& facts = program_facts();
    say(stdout, "cairn {} ({}), {}\n", facts.version, facts.commit, facts.instruction_set);
    std::fflush(stdout);
    int ranks = 1;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    warn_of_memory(estimate(c, ranks).bytes, ranks);
  };
  int code = on_first_rank(prepare);
  if (code == done)
    if (const int error = settle(attempt([&] { code = run_case(c, settings, MPI_COMM_WORLD); }))) code = error;
  const auto close_record = [&] {
    if (const std::string error = record.end(code); !error.empty() && code != failed) throw RunError(error);
  };
  if (const int error = on_first_rank(close_record)) code = error;
  lock.release();
  std::error_code ignored;
  if (code == wrong_input)
    for (const auto& folder : made) fs::remove(folder, ignored);  // removes empty folders only
  return code;
}

}  // namespace cairn::app
