#include "restart.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "cairn/core/error.hpp"
#include "cairn/core/printable.hpp"
#include "cairn/core/say.hpp"
#include "cairn/io/agreement.hpp"
#include "cairn/io/case_changes.hpp"
#include "cairn/io/result_files.hpp"
#include "history_tables.hpp"

namespace cairn {

namespace {

namespace fs = std::filesystem;

constexpr const char* latest = "latest";
constexpr std::size_t most_changes = 20;  // listed in one report

int rank_in(MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

/// The same text on every rank: that of rank 0.
std::string shared_text(std::string text, MPI_Comm comm) {
  int size = static_cast<int>(text.size());
  MPI_Bcast(&size, 1, MPI_INT, 0, comm);
  text.resize(static_cast<std::size_t>(size));
  MPI_Bcast(text.data(), size, MPI_CHAR, 0, comm);
  return text;
}

/// The whole checkpoint with the highest number; damaged ones are reported and passed over.
std::unique_ptr<Checkpoint> open_latest(const fs::path& out, MPI_Comm comm) {
  const bool first = rank_in(comm) == 0;
  std::vector<NumberedFile> files;
  if (first) files = numbered_files(out, "checkpoint");
  int count = static_cast<int>(files.size());
  MPI_Bcast(&count, 1, MPI_INT, 0, comm);
  for (int i = count - 1; i >= 0; --i) {
    const fs::path file = shared_text(first ? files[i].file.string() : "", comm);
    try {
      return std::make_unique<Checkpoint>(file, comm);
    } catch (const InputError& error) {
      if (first) fmt::print(stderr, "warning: {}; the checkpoint before it is tried\n", printable(error.what()));
    }
  }
  throw InputError(fmt::format("--restart latest: {} holds {} checkpoint; run without --restart to start afresh",
                               out.string(), count == 0 ? "no" : "no whole"));
}

/// Turning rigid bodies turn about centres that follow from their velocities since the start.
bool turns_rigidly(const Case& c) {
  const auto turns = [](const BodySpec& body) { return body.angular_velocity != Vec3::Zero(); };
  const auto spins = [](const Drive& drive) { return drive.rotor.mass > 0 || !drive.angular_velocity.is_zero(); };
  return std::ranges::any_of(c.drives, spins) || std::ranges::any_of(c.bodies, [&](const BodySpec& body) {
           return c.materials[body.material].model == "rigid" && turns(body);
         });
}

std::vector<KeyChange> all_changes(const Case& c, const Checkpoint& checkpoint) {
  auto changes = case_changes(checkpoint.case_text(), c.resolved);
  const bool explained = std::ranges::any_of(changes, [](const KeyChange& change) {
    return freedom_of(change.key) != Freedom::free &&
           (change.key.starts_with("bodies") || change.key.starts_with("grains"));
  });
  if (checkpoint.state().bodies != bodies_checksum(c) && !explained)
    changes.push_back({"grains", "(the tables as they were)", "(the tables as they are)"});
  return changes;
}

/// \throws InputError where the changes of the case do not allow to go on
void check_changes(const Case& c, const std::vector<KeyChange>& changes, bool allow, const std::string& name) {
  std::vector<std::string> errors;
  std::size_t refused = 0;
  bool fixed = false;
  for (const KeyChange& change : changes) {
    const bool moves =
        change.key.starts_with("drive") || change.key.starts_with("bodies") || change.key.starts_with("grains");
    Freedom freedom = freedom_of(change.key);
    if (freedom == Freedom::on_demand && moves && turns_rigidly(c)) freedom = Freedom::fixed;
    if (freedom == Freedom::free || (freedom == Freedom::on_demand && allow)) continue;
    fixed = fixed || freedom == Freedom::fixed;
    if (++refused <= most_changes)
      errors.push_back(fmt::format("{}: the case has changed: {}: {} -> {}{}", name, change.key, change.before,
                                   change.after,
                                   freedom == Freedom::fixed ? " (the points depend on it: it can never change)" : ""));
  }
  if (errors.empty()) return;
  if (refused > most_changes) errors.push_back(fmt::format("{}: and {} more keys", name, refused - most_changes));
  errors.back() += fixed ? "; restore the case, or run without --restart"
                         : "; restore the case, or go on with the changes by --allow-changes";
  throw InputError(errors);
}

/// What in the folder of the results keeps the run from going on there; empty if nothing does.
std::string check_folder(const Case& c, const fs::path& out, const RunState& state, const fs::path& checkpoint) {
  constexpr const char* remedy = "; choose another --out to go on there";
  const int dimension = c.domain.dimension;
  const fs::path history = out / "history.csv", bodies = out / "bodies.csv", forces = out / "forces.csv";
  std::string error;
  if (fs::exists(history)) {
    error = check_prefix(history, history_columns(dimension), state.history_file);
    if (error.empty() && state.bodies_file.bytes > 0)
      error = check_prefix(bodies, body_columns(dimension), state.bodies_file);
    if (error.empty() && state.forces_file.bytes > 0) error = check_prefix(forces, force_columns(), state.forces_file);
    if (error.empty() && state.tips_file.bytes > 0)
      error = check_prefix(out / "tips.csv", tip_columns(dimension), state.tips_file);
    return error.empty() ? "" : error + remedy;
  }
  std::error_code ignored;
  for (const auto& file : find_results(out))
    if (!fs::equivalent(file, checkpoint, ignored))
      return fmt::format("{}: holds results ({}) but no history.csv, so that they are not of this run{}", out.string(),
                         file.filename().string(), remedy);
  return {};
}

void print_restart(const Checkpoint& checkpoint, const std::vector<KeyChange>& changes, const fs::path& out) {
  const StepState& step = checkpoint.state().step;
  std::string text =
      fmt::format("going on from {}: step {}, time {} s\n", checkpoint.file().string(), step.steps, step.time);
  for (std::size_t i = 0; i < changes.size() && i < most_changes; ++i)
    text += fmt::format("  changed: {}: {} -> {}\n", changes[i].key, changes[i].before, changes[i].after);
  if (changes.size() > most_changes) text += fmt::format("  and {} more keys\n", changes.size() - most_changes);
  if (!fs::exists(out / "history.csv"))
    text += fmt::format("  {} holds no history.csv yet: it will begin after step {}\n", out.string(), step.steps);
  say(stdout, "{}", printable(text, true));
  std::fflush(stdout);
}

}  // namespace

std::unique_ptr<Checkpoint> open_restart(const Case& c, const RunSettings& settings, MPI_Comm comm) {
  if (settings.restart.empty()) return nullptr;
  auto checkpoint = settings.restart == latest ? open_latest(settings.out, comm)
                                               : std::make_unique<Checkpoint>(settings.restart, comm);
  // Every rank has read the same case and the same checkpoint.
  const auto changes = all_changes(c, *checkpoint);
  check_changes(c, changes, settings.allow_changes, checkpoint->file().string());
  std::string error;
  if (rank_in(comm) == 0) error = check_folder(c, settings.out, checkpoint->state(), checkpoint->file());
  error = common_error(comm, error);
  if (!error.empty()) throw InputError(error);
  if (rank_in(comm) == 0) print_restart(*checkpoint, changes, settings.out);
  return checkpoint;
}

std::string remove_later(const fs::path& out, const RunState& state, const fs::path& checkpoint) {
  std::error_code ignored;
  fs::remove(out / failure_file, ignored);
  const std::pair<const char*, std::int64_t> kinds[] = {
      {"particles", state.particles.count}, {"grains", state.grains.count},  {"contacts", state.contacts.count},
      {"cracks", state.particles.count},    {"tips", state.particles.count}, {"checkpoint", state.checkpoint.count}};
  for (const auto& [kind, count] : kinds)
    for (const auto& [number, file] : numbered_files(out, kind)) {
      std::error_code error;
      if (number < count || fs::equivalent(file, checkpoint, error)) continue;
      fs::remove(file, error);
      if (error) return fmt::format("cannot remove {}: {}", file.string(), error.message());
    }
  return {};
}

void keep_last(const fs::path& out, int keep) {
  auto files = numbered_files(out, "checkpoint");
  std::error_code ignored;  // one too many does no harm
  for (; std::ssize(files) > keep; files.erase(files.begin())) fs::remove(files.front().file, ignored);
}

}  // namespace cairn
