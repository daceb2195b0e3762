#include "cairn/solver/run.hpp"

#include <fmt/format.h>

#include <new>

#include "cairn/core/error.hpp"
#include "cairn/core/printable.hpp"
#include "cairn/core/say.hpp"
#include "cairn/io/agreement.hpp"
#include "cairn/io/case_changes.hpp"
#include "cairn/io/case_folder.hpp"
#include "cairn/io/progress.hpp"
#include "cairn/io/result_files.hpp"
#include "cairn/io/table_file.hpp"
#include "cairn/solver/checkpoint.hpp"
#include "cairn/solver/output.hpp"
#include "history_tables.hpp"
#include "output_clocks.hpp"
#include "parts_watch.hpp"
#include "restart.hpp"
#include "run_report.hpp"
#include "stage_keeper.hpp"
#include "stop_signal.hpp"

namespace cairn {
namespace {

namespace fs = std::filesystem;

double wall_clock() { return MPI_Wtime(); }

constexpr int done = 0, stopped = 4;  // exit codes

// Reasons to stop, above the numbers of signals; the largest of all ranks counts.
constexpr double wall_limit_reached = 1000, file_failed = 2000;

/// For each mass [J/kg]; EnergyBook.
double energy_that_matters(const Case& c) {
  double speed = 0;
  for (const auto& drive : c.drives) speed = std::max(speed, drive.velocity.largest(c.time.end));
  for (const auto& face : c.faces) speed = std::max(speed, face.velocity.largest(c.time.end));
  return c.domain.gravity.largest(c.time.end) * smallest_cell(c.domain) + 0.5 * speed * speed;
}

template <int Dim>
class Run {
 public:
  /// \param stages  where the run stands among the stages of the case as it was given
  /// \param c       the case as it is in that stage; changes with the stages
  Run(Case& c, StageKeeper& stages, const RunSettings& settings, MPI_Comm comm, const Checkpoint* from)
      : case_(c),
        stages_(stages),
        settings_(settings),
        comm_(comm),
        roll_call_(comm),
        start_(wall_clock()),
        simulation_(c, comm, from),
        clocks_(c.output),
        particle_index_(settings.out / "particles.hdf.series"),
        tables_(settings.out, c.output.track, is_ever_active(c, &Output::forces), is_ever_active(c, &Output::tips)),
        book_(energy_that_matters(c)) {
    MPI_Comm_rank(comm_, &rank_);
    MPI_Comm_size(comm_, &ranks_);
    needs_wall_ = needs_wall_time(c.output);
    if (from) restore(from->state());
    simulation_.ask([this] { return notice(); });
    stages_.note_start(simulation_);
    parts_.begin(simulation_);
    open_files(from);
    for (const auto& warning : simulation_.warnings()) fmt::print(stderr, "warning: {}\n", printable(warning));
  }

  /// \throws RunError on every rank, or RankError on those that failed alone
  int execute() {
    try {
      return work();
    } catch (const RunError& error) {
      if (roll_call_.all_here()) throw;
      throw RankError(alone(error.what()));
    } catch (const RankError&) {
      throw;
    } catch (const std::bad_alloc&) {
      throw RankError(alone("out of memory; use fewer points or more ranks"));
    } catch (const std::exception& error) {
      throw RankError(alone(error.what()));
    }
  }

 private:
  int work() {
    if (steps_before_ == 0) write_outputs(true, 0);
    const double stepping = wall_clock();
    double output_wall = 0;
    ProgressDisplay display;
    while (running()) {
      const Notice agreed = advance();
      tell_notes();
      const double before = wall_clock();
      const std::string ended = stages_.ended(simulation_);
      if (!ended.empty() && !stages_.run_ended()) next_stage(ended, display);
      write_outputs(false, agreed.wall);
      if (!ended.empty() && stages_.run_ended()) {
        ended_ = ended;
        break;
      }
      if (rank_ == 0 && display.due(before)) display.show(progress(before - stepping), before);
      if (agreed.stop > 0 && running()) {
        display.finish();
        return stop(agreed);
      }
      output_wall += wall_clock() - before;
    }
    const double step_wall = wall_clock() - stepping - output_wall;
    write_outputs(true, wall_before_ + wall_clock() - start_);
    flush_results();
    display.finish();
    const Totals totals = simulation_.totals();
    if (rank_ == 0) tell_departures(totals), parts_.tell_again();
    if (rank_ == 0 && !ended_.empty())
      say(stdout, "ended at step {}, time {} s: {}\n", simulation_.steps(), simulation_.time(), ended_);
    report_run(simulation_, settings_.profile, summary(step_wall), comm_);
    return done;
  }

  std::string alone(const std::string& reason) const {
    return fmt::format("rank {} after step {}: {}", rank_, simulation_.steps(), reason);
  }

  /// Goes on with what the next stage changes.
  void next_stage(const std::string& why, ProgressDisplay& display) {
    const RunStage* stage = &case_.stages[stages_.stage()];
    display.finish();
    if (rank_ == 0)
      say(stdout, "stage {} ended at step {}, time {} s: {}\n", printable(stage->name), simulation_.steps(),
          simulation_.time(), why);
    stages_.begin_next(simulation_.time());
    apply_stage(case_, *++stage, simulation_.time());
    simulation_.change(case_);
    stages_.note_start(simulation_);
    clocks_.change(case_.output);
    needs_wall_ = needs_wall_ || needs_wall_time(case_.output);
  }

  bool running() const { return simulation_.time() < case_.time.end && simulation_.steps() < case_.time.steps; }

  /// One step, and what the ranks told each other in it.
  Notice advance() {
    try {
      const std::int64_t next = simulation_.steps() + 1;
      simulation_.keep_balance(stages_.weighs(next) || clocks_.history.may_be_due(next));
      simulation_.step(stages_.end() - simulation_.time());
      return simulation_.notice();
    } catch (const RunError& error) {
      if (!roll_call_.all_here()) throw RankError(alone(error.what()));
      fail(error.what());
    }
  }

  /// Tells of points that were dropped, of the first ones in words.
  void tell_notes() {
    constexpr int most_told = 20;
    for (const auto& note : simulation_.take_notes())
      if (++notes_told_ <= most_told)
        fmt::print(stderr, "cairn: {}{}\n", note, notes_told_ == most_told ? "; further ones are not named" : "");
  }

  static void tell_departures(const Totals& t) {
    if (t.points_left + t.points_lost == 0) return;
    say(stdout, "left the domain: {:.0f} points; dropped: {:.0f} points; {:.6g} kg together\n", t.points_left,
        t.points_lost, t.mass_left);
  }

  /// What this rank tells the others in a step.
  Notice notice() const {
    Notice n;
    n.stop = signals_.received();
    if (rank_ != 0) return n;
    n.wall = wall_before_ + wall_clock() - start_;
    if (case_.time.wall_limit > 0 && wall_clock() - start_ >= case_.time.wall_limit) n.stop = wall_limit_reached;
    if (!tables_.error().empty()) n.stop = file_failed;
    return n;
  }

  /// Leaves the points as they are now in a file of their own.
  [[noreturn]] void fail(const std::string& reason) {
    std::string text = fmt::format("the state then is in {} in the folder of the results", failure_file);
    std::vector<std::string> fields = case_.output.particles.fields;
    std::erase(fields, "stress_smooth");  // of points that may be anywhere
    try {
      write_particles(simulation_, next_result(failure_file), fields);
    } catch (const RunError& error) {
      text = fmt::format("the state then is lost: {}", error.what());
    }
    throw RunError(fmt::format("{}; {}", reason, text));
  }

  /// Ends the run early, with a checkpoint.
  int stop(const Notice& agreed) {
    throw_together(comm_, tables_.error());
    if (clocks_.checkpoint.last_step() != simulation_.steps()) write_checkpoint_file(false);
    if (rank_ != 0) return stopped;
    const std::string reason = agreed.stop >= wall_limit_reached
                                   ? fmt::format("time.wall_limit = {} s", case_.time.wall_limit)
                                   : signal_name(static_cast<int>(agreed.stop));
    say(stdout, "stopped by {} at step {}, time {} s; the state is in {}\nresume with: {}--restart latest\n", reason,
        simulation_.steps(), simulation_.time(), last_checkpoint_.string(), settings_.command);
    std::fflush(stdout);
    return stopped;
  }

  void open_files(const Checkpoint* from) {
    std::string error;
    bool goes_on = false;
    if (rank_ == 0) {
      goes_on = from != nullptr && fs::exists(settings_.out / "history.csv");
      if (settings_.overwrite) error = remove_results(settings_.out);
      if (goes_on) error = remove_later(settings_.out, from->state(), from->file());
      remove_leftovers(settings_.out);
      if (error.empty()) error = write_case_files(case_, settings_.out);
      if (error.empty()) tables_.open(from ? &from->state() : nullptr);
      if (error.empty()) error = tables_.error();
      if (error.empty() && settings_.record) error = settings_.record->begin(goes_on, steps_before_);
    }
    throw_together(comm_, error);
    MPI_Bcast(&goes_on, 1, MPI_CXX_BOOL, 0, comm_);
    if (goes_on) particle_index_.restore(from->state().series, comm_);
  }

  /// Writes what is due; with `all`, everything that is active and not written at this step yet.
  void write_outputs(bool all, double wall) {
    const auto measured = simulation_.timers().measure(Stage::output);
    const std::int64_t step = simulation_.steps();
    const double time = simulation_.time();
    const auto wanted = [&](OutputClock& clock) {
      const bool write = clock.active() && clock.last_step() != step && (all || clock.due(step, time, wall));
      if (write) clock.written(step, time, wall);
      return write;
    };
    const auto name = [](const char* kind, const OutputClock& clock) { return numbered_name(kind, clock.count() - 1); };
    if (wanted(clocks_.history)) write_history();
    if (wanted(clocks_.forces)) tables_.add_forces(simulation_);
    if (wanted(clocks_.tips)) tables_.add_tips(simulation_);
    const bool particles = wanted(clocks_.particles);
    if (particles) {
      const std::string file = name("particles", clocks_.particles);
      write_particles(simulation_, next_result(file), case_.output.particles.fields);
      particle_index_.add(file, time, comm_);
      if (!case_.cracks.empty()) write_crack_files(name("cracks", clocks_.particles), name("tips", clocks_.particles));
    }
    const bool grains = wanted(clocks_.grains), contacts = wanted(clocks_.contacts);
    if (grains) write_grains(simulation_, next_result(name("grains", clocks_.grains)));
    if (contacts)
      write_contacts(simulation_, next_result(name("contacts", clocks_.contacts)), time - contacts_cleared_);
    if (contacts || (grains && !clocks_.contacts.active())) simulation_.clear_contacts(), contacts_cleared_ = time;
    if (step == 0) clocks_.checkpoint.skip(step, time, wall);  // nothing is lost by starting again
    const bool checkpoint = wanted(clocks_.checkpoint);
    if (checkpoint) write_checkpoint_file(true);
    if (all || particles || grains || checkpoint) parts_.look(simulation_);
  }

  void write_crack_files(const std::string& cracks, const std::string& tips) {
    write_cracks(simulation_, next_result(cracks));
    const auto has_tip = [](const CrackSpec& c) { return c.ends[0] == CrackEnd::tip || c.ends[1] == CrackEnd::tip; };
    if (std::ranges::any_of(case_.cracks, has_tip)) write_tips(simulation_, next_result(tips));
  }

  /// The path of a result file that is to be written.
  fs::path next_result(const std::string& name) {
    fs::path file = settings_.out / name;
    if (rank_ == 0) unflushed_.add(file);
    return file;
  }

  /// Has the disk hold all results. Until then they may still be in the system's memory: waiting for the disk after
  /// each file would cost several times the writing.
  void flush_results() {
    throw_together(comm_, unflushed_.flush());
    tables_.flush();
    throw_together(comm_, tables_.error());
  }

  void write_history() {
    const Totals t = simulation_.totals();
    if (rank_ == 0) book_.add(t);
    tables_.add(simulation_, t, book_.error());
    const double limit = case_.solver.energy_limit;
    if (limit == 0) return;
    double error = book_.error();
    MPI_Bcast(&error, 1, MPI_DOUBLE, 0, comm_);
    if (!(std::abs(error) <= limit))
      fail(fmt::format("step {}: the energy error is {:.3g}, above solver.energy_limit = {}", simulation_.steps(),
                       error, limit));
  }

  /// Writes a checkpoint under the next number. One that is `scheduled` has been counted; another one, at a stop,
  /// leaves the count alone, so that the files that follow have the numbers of a run that was not stopped.
  void write_checkpoint_file(bool scheduled) {
    flush_results();  // what comes before a checkpoint is not written again
    RunState state;
    state.step = simulation_.step_state();
    state.tools = simulation_.tool_states(), state.cracks = simulation_.crack_states();
    state.parts = simulation_.parts(), state.spared = simulation_.spared();
    state.stage = stages_.state(), state.pouring = simulation_.pouring();
    tables_.note_positions(state);
    share_rank_zero(state);
    clocks_.note(state);
    state.contacts_cleared = contacts_cleared_, state.contacts_kept = contacts_kept();
    state.series = particle_index_.entries();
    state.bodies = bodies_checksum(case_);
    const std::int64_t number = clocks_.checkpoint.count() - (scheduled ? 1 : 0);
    last_checkpoint_ = settings_.out / numbered_name("checkpoint", number);
    write_checkpoint(last_checkpoint_, simulation_, state, case_.resolved);
    if (rank_ == 0) keep_last(settings_.out, case_.output.checkpoint.keep);
  }

  /// What rank 0 alone knows.
  void share_rank_zero(RunState& state) {
    state.energy = book_.state();
    if (needs_wall_) state.wall = wall_before_ + wall_clock() - start_;
    MPI_Bcast(&state.energy, sizeof state.energy, MPI_BYTE, 0, comm_);
    MPI_Bcast(&state.wall, 1, MPI_DOUBLE, 0, comm_);
    for (CsvPosition* file : {&state.history_file, &state.bodies_file, &state.forces_file, &state.tips_file})
      MPI_Bcast(file, sizeof *file, MPI_BYTE, 0, comm_);
  }

  void restore(const RunState& state) {
    clocks_.restore(state);
    book_.restore(state.energy);
    // Contacts that this run is the first to keep are summed from now on.
    contacts_cleared_ = contacts_kept() && !state.contacts_kept ? simulation_.time() : state.contacts_cleared;
    if (!contacts_kept()) simulation_.clear_contacts();
    steps_before_ = simulation_.steps();
    fraction_before_ = fraction();
    wall_before_ = state.wall;
  }

  bool contacts_kept() const {
    return is_ever_active(case_, &Output::grains) || is_ever_active(case_, &Output::contacts);
  }

  double fraction() const {
    const double by_time = std::isfinite(case_.time.end) ? simulation_.time() / case_.time.end : 0;
    return std::max(by_time, static_cast<double>(simulation_.steps()) / static_cast<double>(case_.time.steps));
  }
  double steps_here() const { return static_cast<double>(simulation_.steps() - steps_before_); }

  Progress progress(double wall) const {
    Progress p;
    p.fraction = fraction();
    p.time = simulation_.time(), p.step = simulation_.steps(), p.dt = simulation_.dt(),
    p.points = simulation_.total_points();
    p.point_steps_per_second_rank = wall > 0 ? static_cast<double>(p.points) * steps_here() / wall / ranks_ : 0;
    p.energy_error = book_.error();
    p.wall_left = estimate_wall_left(p.fraction, fraction_before_, wall);
    return p;
  }

  /// All but the points.
  RunSummary summary(double step_wall) const {
    RunSummary s;
    s.steps = simulation_.steps() - steps_before_, s.time = simulation_.time();
    s.wall = wall_clock() - start_, s.step_wall = step_wall;
    s.energy_error = book_.error(), s.ranks = ranks_;
    return s;
  }

  Case& case_;
  StageKeeper& stages_;
  std::string ended_;  // why the run ended, where a condition said so
  const RunSettings& settings_;
  MPI_Comm comm_;
  int rank_ = 0, ranks_ = 1;
  RollCall roll_call_;
  StopSignals signals_;
  double start_;
  Simulation<Dim> simulation_;
  OutputClocks clocks_;
  SeriesIndex particle_index_;
  HistoryTables<Dim> tables_;
  EnergyBook book_;
  PartsWatch parts_;
  bool needs_wall_ = false;      // an output depends on wall time
  double contacts_cleared_ = 0;  // [s]
  fs::path last_checkpoint_;
  UnflushedFiles unflushed_;       // of rank 0
  std::int64_t steps_before_ = 0;  // of the run, before this process
  double fraction_before_ = 0, wall_before_ = 0;
  int notes_told_ = 0;
};

template <int Dim>
int run(Case& c, const RunSettings& settings, MPI_Comm comm) {
  auto from = open_restart(c, settings, comm);
  StageKeeper stages(c, from ? &from->state() : nullptr);
  stages.bring_up(c);
  Run<Dim> work(c, stages, settings, comm, from.get());
  from.reset();  // its file is open no longer than needed
  return work.execute();
}

}  // namespace

int run_case(Case c, const RunSettings& settings, MPI_Comm comm) {
  return c.domain.dimension == 2 ? run<2>(c, settings, comm) : run<3>(c, settings, comm);
}

}  // namespace cairn
