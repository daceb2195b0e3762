#pragma once
/// Signals that ask a run to stop: SIGTERM, SIGINT, SIGUSR1, SIGUSR2, SIGHUP (unless it is ignored, as under nohup) and
/// SIGXCPU.

namespace cairn {

/// Catches the signals while it lives; restores what was there before. One at a time.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// The signal that came last, 0 if none did.
  int received() const;
};

/// "SIGTERM" and so on.
const char* signal_name(int signal);

}  // namespace cairn
