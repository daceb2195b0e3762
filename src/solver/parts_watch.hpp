#pragma once
/// Tells of bodies whose points have parted on the grid, so that they hang together no more, though no law or crack
/// said so.

#include <fmt/format.h>

#include <set>

#include "body_parts.hpp"
#include "cairn/core/say.hpp"

namespace cairn {

class PartsWatch {
 public:
  /// Notes which bodies are in parts from the start: a compound of shapes that lie apart may be one. Collective.
  template <int Dim>
  void begin(const Simulation<Dim>& simulation) {
    at_start_ = bodies_in_parts(simulation);
  }

  /// Warns, once for each body and of the first ones in words. Collective.
  template <int Dim>
  void look(const Simulation<Dim>& simulation) {
    constexpr std::size_t most_told = 5;
    for (const auto& [body, parts] : bodies_in_parts(simulation)) {
      const auto before = at_start_.find(body);
      if (parts <= (before == at_start_.end() ? 1 : before->second) || !parted_.insert(body).second) continue;
      if (parted_.size() > most_told) continue;
      fmt::print(stderr,
                 "warning: step {}, time {} s: body {} is in {} parts: its points have moved so far from each other "
                 "that no node sees two of them, and no law or crack said so{}\n",
                 simulation.steps(), simulation.time(), body, parts,
                 parted_.size() == most_told ? "; further ones are not named"
                                             : "; see \"Bodies that tear\" in docs/shape-functions.md");
    }
  }

  /// On rank 0.
  void tell_again() const {
    if (parted_.empty()) return;
    say(stdout, "torn by the grid alone: {} {}, the first is body {}\n", parted_.size(),
        parted_.size() == 1 ? "body" : "bodies", *parted_.begin());
  }

 private:
  std::map<std::int64_t, int> at_start_;
  std::set<std::int64_t> parted_;
};

}  // namespace cairn
