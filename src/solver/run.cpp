#include "cairn/solver/run.hpp"

#include "cairn/core/error.hpp"
#include "cairn/io/agreement.hpp"
#include "cairn/io/history.hpp"
#include "cairn/io/progress.hpp"
#include "cairn/io/result_files.hpp"
#include "cairn/io/table_file.hpp"
#include "cairn/solver/body_states.hpp"
#include "cairn/solver/output.hpp"

#include <fmt/format.h>

#include <fstream>

namespace cairn {
namespace {

namespace fs = std::filesystem;

double wall_clock() { return MPI_Wtime(); }

/// Says when an output is due, and counts what was written.
class OutputClock {
 public:
  explicit OutputClock(const Schedule& schedule) : schedule_(schedule) {}
  bool active() const { return schedule_.active(); }
  /// Due after this step? `wall` [s] since the start of the run, agreed by all ranks.
  bool due(std::int64_t step, double time, double wall) const {
    if (schedule_.every > 0 && step % schedule_.every == 0) return true;
    if (schedule_.interval > 0 && intervals(time, schedule_.interval) > last_interval_) return true;
    return schedule_.interval_wall > 0 && wall - last_wall_ >= schedule_.interval_wall;
  }
  void written(std::int64_t step, double time, double wall) {
    last_step_ = step, last_wall_ = wall, ++count_;
    if (schedule_.interval > 0) last_interval_ = intervals(time, schedule_.interval);
  }
  std::int64_t last_step() const { return last_step_; }
  int count() const { return count_; }
  const Schedule& schedule() const { return schedule_; }

 private:
  // A rounding error's worth early counts as reached.
  static std::int64_t intervals(double time, double interval) {
    return static_cast<std::int64_t>(std::floor(time / interval * (1 + 1e-12)));
  }
  Schedule schedule_;
  std::int64_t last_step_ = -1, last_interval_ = -1;
  double last_wall_ = 0;
  int count_ = 0;
};

/// The energies' error over the largest energy seen.
class EnergyBook {
 public:
  /// Energies of a row; the first call sets what they started from.
  double error(const Totals& t) {
    if (!started_) started_ = true, initial_ = t;
    largest_ = std::max({largest_, t.kinetic + t.strain + t.plastic + std::abs(t.potential - initial_.potential),
                         std::abs(t.boundary_work)});
    return largest_ > 0 ? (t.energy() - initial_.energy()) / largest_ : 0.0;
  }

 private:
  bool started_ = false;
  Totals initial_;
  double largest_ = 0;
};

std::vector<std::string> history_columns(int dimension) {
  std::vector<std::string> names = {"step", "time", "dt", "kinetic_energy", "strain_energy", "potential_energy",
                                    "plastic_dissipation", "contact_dissipation", "boundary_work", "energy_error",
                                    "momentum_x", "momentum_y"};
  if (dimension == 3) names.emplace_back("momentum_z");
  names.insert(names.end(), {"contact_nodes", "mass"});
  return names;
}

std::vector<std::string> body_columns(int dimension) {
  if (dimension == 2) return {"step", "time", "body", "x", "y", "vx", "vy", "wz"};
  return {"step", "time", "body", "x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz"};
}

template <int Dim>
class Run {
 public:
  Run(const Case& c, const RunSettings& settings, MPI_Comm comm)
      : case_(c), settings_(settings), comm_(comm), start_(wall_clock()), simulation_(c, comm),
        particles_(c.output.particles), grains_(c.output.grains), contacts_(c.output.contacts), history_clock_(c.output.history),
        particle_index_(settings.out / "particles.hdf.series") {
    MPI_Comm_rank(comm_, &rank_);
    MPI_Comm_size(comm_, &ranks_);
  }

  int execute() {
    open_files();
    write_outputs(true);
    const double stepping = wall_clock();
    double output_wall = 0;
    ProgressDisplay display;
    while (simulation_.time() < case_.time.end && simulation_.steps() < case_.time.steps) {
      advance();
      const double before = wall_clock();
      write_outputs(false);
      if (rank_ == 0 && display.due(before)) display.show(progress(before - stepping), before);
      output_wall += wall_clock() - before;
    }
    const double step_wall = wall_clock() - stepping - output_wall;
    write_outputs(true);
    throw_together(comm_, file_error());
    display.finish();
    report(step_wall);
    return 0;
  }

 private:
  /// One step; when it fails, the points as they are then go to a file of their own.
  void advance() {
    try {
      simulation_.step(case_.time.end - simulation_.time());
    } catch (const RunError& error) {
      const fs::path file = settings_.out / "failure_particles.vtkhdf";
      write_particles(simulation_, file, case_.output.particles.fields);
      throw RunError(fmt::format("{}; the state then is in {}", error.what(), file.string()));
    }
  }

  void open_files() {
    std::string error;
    if (rank_ == 0 && settings_.overwrite) error = remove_results(settings_.out);
    if (rank_ == 0 && error.empty()) {
      std::ofstream text(settings_.out / "case.toml");
      if (!(text << case_.resolved << std::flush)) error = fmt::format("cannot write {}", (settings_.out / "case.toml").string());
    }
    if (rank_ == 0 && error.empty()) {
      history_ = CsvWriter(settings_.out / "history.csv", history_columns(Dim));
      if (!case_.output.track.empty()) bodies_ = CsvWriter(settings_.out / "bodies.csv", body_columns(Dim));
    }
    throw_together(comm_, error.empty() ? file_error() : error);
  }

  std::string file_error() const { return history_.error().empty() ? bodies_.error() : history_.error(); }

  /// Writes what is due; with `all`, everything that is active and not written at this step yet.
  void write_outputs(bool all) {
    const double wall = agreed_wall();
    const std::int64_t step = simulation_.steps();
    const double time = simulation_.time();
    const auto wanted = [&](OutputClock& clock) {
      const bool write = clock.active() && clock.last_step() != step && (all || clock.due(step, time, wall));
      if (write) clock.written(step, time, wall);
      return write;
    };
    const auto name = [](const char* kind, const OutputClock& clock, const char* ending) {
      return fmt::format("{}_{:06}.{}", kind, clock.count() - 1, ending);
    };
    if (wanted(history_clock_)) write_history();
    if (wanted(particles_)) {
      const std::string file = name("particles", particles_, "vtkhdf");
      write_particles(simulation_, settings_.out / file, case_.output.particles.fields);
      particle_index_.add(file, time, comm_);
    }
    const bool grains = wanted(grains_), contacts = wanted(contacts_);
    if (grains) write_grains(simulation_, settings_.out / name("grains", grains_, "h5"));
    if (contacts) write_contacts(simulation_, settings_.out / name("contacts", contacts_, "h5"), time - contacts_cleared_);
    if (contacts || (grains && !contacts_.active())) simulation_.clear_contacts(), contacts_cleared_ = time;
  }

  /// Wall time since the start as rank 0 sees it, where an output depends on it.
  double agreed_wall() {
    double wall = wall_clock() - start_;
    const auto& o = case_.output;
    if (o.particles.interval_wall > 0 || o.grains.interval_wall > 0 || o.contacts.interval_wall > 0 || o.history.interval_wall > 0)
      MPI_Bcast(&wall, 1, MPI_DOUBLE, 0, comm_);
    return wall;
  }

  void write_history() {
    const Totals t = simulation_.totals();
    energy_error_ = book_.error(t);
    if (rank_ == 0) {
      std::vector<CsvValue> row = {simulation_.steps(), simulation_.time(), simulation_.dt(), t.kinetic, t.strain, t.potential,
                                   t.plastic, t.contact_dissipation, t.boundary_work, energy_error_};
      for (int d = 0; d < Dim; ++d) row.emplace_back(t.momentum[d]);
      row.emplace_back(static_cast<std::int64_t>(t.contact_nodes));
      row.emplace_back(t.mass);
      history_.add_row(row);
    }
    if (!case_.output.track.empty()) write_bodies();
  }

  void write_bodies() {
    // Tracked bodies are few: each rank sends those it answers for to rank 0.
    constexpr int width = 10;
    std::vector<double> mine;
    for (const BodyState& s : body_states(simulation_))
      if (std::find(case_.output.track.begin(), case_.output.track.end(), s.body) != case_.output.track.end()) {
        mine.push_back(s.body);
        for (const Vec3& v : {s.centre, s.velocity, s.angular_velocity}) mine.insert(mine.end(), v.data(), v.data() + 3);
      }
    std::vector<int> counts(ranks_), starts(ranks_, 0);
    const int count = static_cast<int>(mine.size());
    MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, comm_);
    for (int r = 1; r < ranks_; ++r) starts[r] = starts[r - 1] + counts[r - 1];
    std::vector<double> all(rank_ == 0 ? starts.back() + counts.back() : 0);
    MPI_Gatherv(mine.data(), count, MPI_DOUBLE, all.data(), counts.data(), starts.data(), MPI_DOUBLE, 0, comm_);
    for (std::size_t i = 0; i < all.size(); i += width) {
      std::vector<CsvValue> row = {simulation_.steps(), simulation_.time(), static_cast<std::int64_t>(all[i])};
      for (int group = 0; group < 3; ++group)
        for (int d = 0; d < 3; ++d)
          if (Dim == 3 || (group == 2) == (d == 2)) row.emplace_back(all[i + 1 + 3 * group + d]);
      bodies_.add_row(row);
    }
  }

  Progress progress(double wall) const {
    Progress p;
    const double by_time = std::isfinite(case_.time.end) ? simulation_.time() / case_.time.end : 0;
    p.fraction = std::max(by_time, static_cast<double>(simulation_.steps()) / static_cast<double>(case_.time.steps));
    p.time = simulation_.time(), p.step = simulation_.steps(), p.dt = simulation_.dt(), p.points = simulation_.total_points();
    p.point_steps_per_second_rank = wall > 0 ? static_cast<double>(p.points) * static_cast<double>(p.step) / wall / ranks_ : 0;
    p.energy_error = energy_error_;
    p.wall_left = estimate_wall_left(p.fraction, 0, wall);
    return p;
  }

  void report(double step_wall) const {
    if (rank_ != 0) return;
    double total = 0;
    std::string shares;
    for (std::size_t s = 0; s + 1 < stage_names.size(); ++s) total += simulation_.timers().seconds(static_cast<Stage>(s));
    for (std::size_t s = 0; s + 1 < stage_names.size(); ++s)
      shares += fmt::format(" {} {:.1f} %", stage_names[s], 100 * simulation_.timers().seconds(static_cast<Stage>(s)) / std::max(total, 1e-30));
    fmt::print("time of rank 0:{}\n", shares);
    if (settings_.profile) {
      const double steps = static_cast<double>(std::max<std::int64_t>(1, simulation_.steps()));
      fmt::print("sent by rank 0: {:.1f} messages and {:.0f} bytes a step\n", simulation_.traffic().messages / steps,
                 simulation_.traffic().bytes / steps);
    }
    RunSummary s;
    s.steps = simulation_.steps(), s.points = simulation_.total_points(), s.time = simulation_.time();
    s.wall = wall_clock() - start_, s.step_wall = step_wall;
    s.point_steps = static_cast<double>(s.steps) * static_cast<double>(s.points);
    s.energy_error = energy_error_, s.ranks = ranks_;
    fmt::print("{}\n", format_summary(s));
  }

  const Case& case_;
  const RunSettings& settings_;
  MPI_Comm comm_;
  int rank_ = 0, ranks_ = 1;
  double start_;
  Simulation<Dim> simulation_;
  OutputClock particles_, grains_, contacts_, history_clock_;
  SeriesIndex particle_index_;
  CsvWriter history_, bodies_;
  EnergyBook book_;
  double energy_error_ = 0, contacts_cleared_ = 0;
};

}  // namespace

int run_case(const Case& c, const RunSettings& settings, MPI_Comm comm) {
  if (!settings.restart.empty()) throw InputError("--restart: this version writes no checkpoints; run without it");
  if (c.domain.dimension == 2) return Run<2>(c, settings, comm).execute();
  return Run<3>(c, settings, comm).execute();
}

}  // namespace cairn
