#include "cairn/io/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "cairn/core/say.hpp"

namespace cairn {

namespace {

constexpr double terminal_interval = 0.2, file_interval = 10.0;  // [s]

/// h:mm:ss
std::string format_duration(double seconds) {
  if (!(seconds >= 0) || seconds > 1e9) return "?";
  const auto all = static_cast<std::int64_t>(std::ceil(seconds));
  return fmt::format("{}:{:02}:{:02}", all / 3600, all / 60 % 60, all % 60);
}

}  // namespace

double estimate_wall_left(double fraction, double fraction_at_start, double wall) {
  const double done = fraction - fraction_at_start;
  return done > 0 && wall > 0 ? wall * (1.0 - fraction) / done : -1.0;
}

std::string format_progress(const Progress& p) {
  return fmt::format(
      "{:5.1f} %  t {:.4g} s  step {}  dt {:.3g} s  {} points  {:.3g} M point-steps/s/rank  energy error {:.2g}  left "
      "{}",
      100.0 * p.fraction, p.time, p.step, p.dt, p.points, 1e-6 * p.point_steps_per_second_rank, p.energy_error,
      format_duration(p.wall_left));
}

namespace {

/// True where a person watches the stream. Under Open MPI rank 0 always writes to a terminal of mpirun's own making:
/// what counts is where mpirun, the parent, writes to.
bool is_watched(std::FILE* stream) {
  if (::isatty(::fileno(stream)) != 1) return false;
  if (std::getenv("OMPI_COMM_WORLD_SIZE") == nullptr) return true;
  std::error_code unreadable;
  const auto target = std::filesystem::read_symlink(fmt::format("/proc/{}/fd/1", ::getppid()), unreadable).string();
  return target.starts_with("/dev/pts/") || target.starts_with("/dev/tty");
}

}  // namespace

ProgressDisplay::ProgressDisplay(std::FILE* stream) : ProgressDisplay(stream, is_watched(stream)) {}

void ProgressDisplay::show(const Progress& progress, double wall) {
  if (!due(wall)) return;
  next_ = wall + (terminal_ ? terminal_interval : file_interval);
  const std::string line = format_progress(progress);
  if (terminal_) {
    say(stream_, "\r{:<{}}", line, length_);  // blanks over what a longer line left
    length_ = line.size();
  } else {
    say(stream_, "{}\n", line);
  }
  std::fflush(stream_);
}

void ProgressDisplay::finish() {
  if (length_ == 0) return;
  say(stream_, "\n");
  std::fflush(stream_);
  length_ = 0;
}

std::string format_summary(const RunSummary& s) {
  const double rate = s.step_wall > 0 ? s.point_steps / s.step_wall : 0.0;
  return fmt::format(
      "done steps={} points={} time={} wall={:.3f} step_wall={:.3f} point_steps_per_s={:.6g} energy_error={} ranks={}",
      s.steps, s.points, s.time, s.wall, s.step_wall, rate, s.energy_error, s.ranks);
}

}  // namespace cairn
