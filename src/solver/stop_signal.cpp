#include "stop_signal.hpp"

#include <array>
#include <csignal>

namespace cairn {

namespace {

struct Named {
  int number;
  const char* name;
};
constexpr std::array<Named, 6> signals = {{{SIGTERM, "SIGTERM"},
                                           {SIGINT, "SIGINT"},
                                           {SIGUSR1, "SIGUSR1"},
                                           {SIGUSR2, "SIGUSR2"},
                                           {SIGHUP, "SIGHUP"},
                                           {SIGXCPU, "SIGXCPU"}}};

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
  for (std::size_t i = 0; i < signals.size(); ++i) {
    sigaction(signals[i].number, &action, &previous_actions[i]);
    // nohup: the terminal may go.
    if (signals[i].number == SIGHUP && previous_actions[i].sa_handler == SIG_IGN)
      sigaction(SIGHUP, &previous_actions[i], nullptr);
  }
}

StopSignals::~StopSignals() {
  for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i].number, &previous_actions[i], nullptr);
}

int StopSignals::received() const { return last_signal; }

const char* signal_name(int signal) {
  for (const Named& known : signals)
    if (known.number == signal) return known.name;
  return "a signal";
}

}  // namespace cairn
