#pragma once
/// The clocks of all outputs that are written by a schedule. A further one is a line of the table.

#include <algorithm>

#include "cairn/solver/run_state.hpp"

namespace cairn {

struct OutputClocks {
  OutputClock particles, grains, contacts, forces, tips, history, checkpoint;

  explicit OutputClocks(const Output& o)
      : particles(o.particles),
        grains(o.grains),
        contacts(o.contacts),
        forces(o.forces),
        tips(o.tips),
        history(o.history),
        checkpoint(o.checkpoint) {}

  /// Goes by other schedules from now on.
  void change(const Output& o);
  void restore(const RunState& state);
  void note(RunState& state) const;
};

/// Where the clock, the schedule and the state of an output are.
struct ScheduledOutput {
  OutputClock OutputClocks::*clock;
  Schedule Output::*schedule;
  ClockState RunState::*state;
};
inline constexpr ScheduledOutput scheduled_outputs[] = {
    {&OutputClocks::particles, &Output::particles, &RunState::particles},
    {&OutputClocks::grains, &Output::grains, &RunState::grains},
    {&OutputClocks::contacts, &Output::contacts, &RunState::contacts},
    {&OutputClocks::forces, &Output::forces, &RunState::forces},
    {&OutputClocks::tips, &Output::tips, &RunState::tips},
    {&OutputClocks::history, &Output::history, &RunState::history},
    {&OutputClocks::checkpoint, &Output::checkpoint, &RunState::checkpoint}};

inline void OutputClocks::change(const Output& o) {
  for (const auto& output : scheduled_outputs) (this->*output.clock).change(o.*output.schedule);
}
inline void OutputClocks::restore(const RunState& state) {
  for (const auto& output : scheduled_outputs) (this->*output.clock).restore(state.*output.state);
}
inline void OutputClocks::note(RunState& state) const {
  for (const auto& output : scheduled_outputs) state.*output.state = (this->*output.clock).state();
}

/// Whether something is written by wall time.
inline bool needs_wall_time(const Output& o) {
  return std::ranges::any_of(scheduled_outputs,
                             [&](const auto& output) { return (o.*output.schedule).interval_wall > 0; });
}

/// Whether an output is written, now or in a stage to come.
inline bool is_ever_active(const Case& c, Schedule Output::*schedule) {
  return (c.output.*schedule).active() ||
         std::ranges::any_of(c.stages, [&](const RunStage& s) { return (s.changed->output.*schedule).active(); });
}

}  // namespace cairn
