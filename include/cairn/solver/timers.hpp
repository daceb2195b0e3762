#pragma once
/// Wall time of the stages of a step on one rank. Measured times steer nothing that a result depends on.

#include <array>
#include <chrono>
#include <ctime>

namespace cairn {

/// Processor time of this thread so far [s]: unlike wall time, not what other processes took.
inline double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

enum class Stage { project, exchange, contact, stress, integrate, update, migrate, output, count };
inline constexpr std::array<const char*, static_cast<std::size_t>(Stage::count)> stage_names = {
    "project", "exchange", "contact", "stress", "integrate", "update", "migrate", "output"};

class StageTimers {
 public:
  /// Adds the time until it goes out of scope to a stage.
  class Scope {
   public:
    Scope(double& seconds) : seconds_(seconds), start_(std::chrono::steady_clock::now()) {}
    ~Scope() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    double& seconds_;
    std::chrono::steady_clock::time_point start_;
  };
  Scope measure(Stage stage) { return Scope(seconds_[static_cast<std::size_t>(stage)]); }
  double seconds(Stage stage) const { return seconds_[static_cast<std::size_t>(stage)]; }

 private:
  std::array<double, static_cast<std::size_t>(Stage::count)> seconds_{};
};

}  // namespace cairn
