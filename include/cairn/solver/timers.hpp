#pragma once
/// Wall time of the stages of a step on one rank. Measured times steer nothing that a result depends on.

#include <array>
#include <chrono>
#include <ctime>
#include <utility>

namespace cairn {

/// Processor time of this thread so far [s]: unlike wall time, not what other processes took.
inline double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

enum class Stage { filter, project, exchange, contact, stress, integrate, update, migrate, output, count };
inline constexpr std::array<const char*, static_cast<std::size_t>(Stage::count)> stage_names = {
    "filter", "project", "exchange", "contact", "stress", "integrate", "update", "migrate", "output"};

class StageTimers {
 public:
  /// Adds the time until it goes out of scope to a stage. Scopes may nest: time counts for the innermost.
  class Scope {
   public:
    Scope(StageTimers& timers, Stage stage) : timers_(timers), outer_(timers.enter(stage)) {}
    ~Scope() { timers_.enter(outer_); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    StageTimers& timers_;
    Stage outer_;
  };
  /// Not inline: a test puts a function that throws in the place of this one, and so reaches every stage of a step.
  Scope measure(Stage stage);
  double seconds(Stage stage) const { return seconds_[static_cast<std::size_t>(stage)]; }

 private:
  using Clock = std::chrono::steady_clock;

  /// Time counts for `stage` from now on (`count`: for none); returns what it counted for.
  Stage enter(Stage stage) {
    const auto now = Clock::now();
    seconds_[static_cast<std::size_t>(stage_)] += std::chrono::duration<double>(now - since_).count();
    since_ = now;
    return std::exchange(stage_, stage);
  }

  std::array<double, static_cast<std::size_t>(Stage::count) + 1> seconds_{};
  Stage stage_ = Stage::count;
  Clock::time_point since_{};
};

}  // namespace cairn
