#pragma once
/// What a run says while it goes, and its last line.

#include <cstdint>
#include <cstdio>
#include <string>

namespace cairn {

/// Where a run stands.
struct Progress {
  double fraction = 0;  // of the run that is done, 0 to 1
  double time = 0;      // simulated [s]
  std::int64_t step = 0;
  double dt = 0;                           // [s]
  std::int64_t points = 0;                 // over all ranks
  double point_steps_per_second_rank = 0;  // for each rank [1/s]
  double energy_error = 0;                 // relative
  double wall_left = 0;                    // [s]; negative: not known yet
};

/// Time left at the pace so far [s], or -1 while there is none. `wall` [s]: since the run was at `fraction_at_start`
/// (not 0 after a restart).
double estimate_wall_left(double fraction, double fraction_at_start, double wall);

/// One line in words, without line end:
/// " 42.0 %  t 1.234e-06 s  step 1234  dt 1.2e-09 s  12345 points  4.56 M point-steps/s/rank  energy error 1.2e-05 left
/// 0:12:34".
std::string format_progress(const Progress& progress);

/// Shows progress on rank 0 (make it there only): on a terminal as one line that is rewritten, elsewhere as whole
/// lines at intervals of at least 10 s.
class ProgressDisplay {
 public:
  explicit ProgressDisplay(std::FILE* stream = stdout);
  ProgressDisplay(std::FILE* stream, bool terminal) : stream_(stream), terminal_(terminal) {}

  /// Whether show() would print at `wall` [s, any monotonic clock]; asking costs nothing.
  bool due(double wall) const { return wall >= next_; }
  /// Prints if due.
  void show(const Progress& progress, double wall);
  /// Ends the rewritten line, so that what is printed next starts on its own. May be called more than once.
  void finish();

 private:
  std::FILE* stream_;
  bool terminal_;
  double next_ = 0;         // [s]
  std::size_t length_ = 0;  // of the line on the terminal
};

/// What the last line of a run holds.
struct RunSummary {
  std::int64_t steps = 0, points = 0;  // steps: of this process, points: at the end
  double time = 0;                     // simulated [s]
  double wall = 0, step_wall = 0;      // whole run, stepping only [s]
  double point_steps = 0;              // points advanced, summed over the steps
  double energy_error = 0;             // relative
  int ranks = 1;
};

/// `done steps=N points=N time=T wall=S step_wall=S point_steps_per_s=R energy_error=E ranks=N`, without line end.
std::string format_summary(const RunSummary& summary);

}  // namespace cairn
