#pragma once
/// When outputs are due.

#include <cmath>
#include <cstdint>

#include "cairn/io/case.hpp"

namespace cairn {

/// What an output's clock has to remember.
struct ClockState {
  std::int64_t last_step = -1;  // at which it was written; -1: never
  double last_time = -1;        // [s]
  double last_wall = 0;         // [s] since the start of the run, earlier parts before restarts included
  std::int64_t count = 0;       // files written so far: the number of the next
};

/// Says when an output is due, and counts what was written.
class OutputClock {
 public:
  explicit OutputClock(const Schedule& schedule) : schedule_(schedule) {}
  bool active() const { return schedule_.active(); }
  /// Due after this step? `wall` [s] since the start of the run, agreed by all ranks.
  bool due(std::int64_t step, double time, double wall) const {
    if (schedule_.every > 0 && step % schedule_.every == 0) return true;
    if (schedule_.interval > 0 && intervals(time) > intervals(state_.last_time)) return true;
    return schedule_.interval_wall > 0 && wall - state_.last_wall >= schedule_.interval_wall;
  }
  /// Whether it may be due after a step whose time is not known yet.
  bool may_be_due(std::int64_t step) const {
    return (schedule_.every > 0 && step % schedule_.every == 0) || schedule_.interval > 0 ||
           schedule_.interval_wall > 0;
  }
  /// Goes by other intervals from now on.
  void change(const Schedule& schedule) { schedule_ = schedule; }
  void written(std::int64_t step, double time, double wall) {
    skip(step, time, wall);
    ++state_.count;
  }
  /// Counts from here as if it had been written.
  void skip(std::int64_t step, double time, double wall) {
    state_.last_step = step, state_.last_time = time;
    if (schedule_.interval_wall > 0) state_.last_wall = wall;  // else it depends on no wall time, and neither do files
  }
  std::int64_t last_step() const { return state_.last_step; }
  std::int64_t count() const { return state_.count; }
  const ClockState& state() const { return state_; }
  void restore(const ClockState& state) { state_ = state; }

 private:
  // A rounding error's worth early counts as reached.
  std::int64_t intervals(double time) const {
    return time < 0 ? -1 : static_cast<std::int64_t>(std::floor(time / schedule_.interval * (1 + 1e-12)));
  }
  Schedule schedule_;
  ClockState state_;
};

}  // namespace cairn
