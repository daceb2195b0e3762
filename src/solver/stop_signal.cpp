#include "stop_signal.hpp"

#include <array>
#include <csignal>

namespace cairn {

namespace {

constexpr std::array signals = {SIGTERM, SIGINT, SIGUSR1};

// A handler can reach nothing else.
volatile std::sig_atomic_t last_signal = 0;
std::array<struct sigaction, signals.size()> previous_actions{};

extern "C" void remember_signal(int signal) { last_signal = signal; }

}  // namespace

StopSignals::StopSignals() {
  last_signal = 0;
  struct sigaction action = {};
  action.sa_handler = remember_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &action, &previous_actions[i]);
}

StopSignals::~StopSignals() {
  for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &previous_actions[i], nullptr);
}

int StopSignals::received() const { return last_signal; }

const char* signal_name(int signal) {
  return signal == SIGTERM ? "SIGTERM" : signal == SIGINT ? "SIGINT" : signal == SIGUSR1 ? "SIGUSR1" : "a signal";
}

}  // namespace cairn
