#pragma once
/// The energies' error over the largest energy seen.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "cairn/solver/simulation.hpp"

namespace cairn {

/// What the book has to remember [J].
struct EnergyBookState {
  std::int64_t started = 0;
  double initial = 0, initial_potential = 0;  // of the first row
  double largest = 0;
  double error = 0;  // of the last row
};

class EnergyBook {
 public:
  /// Enters the energies of a row; the first sets what they started from.
  void add(const Totals& t) {
    if (!state_.started) state_.started = 1, state_.initial = t.energy(), state_.initial_potential = t.potential;
    state_.largest =
        std::max({state_.largest,
                  t.kinetic + t.strain + t.plastic + t.viscous + std::abs(t.potential - state_.initial_potential),
                  std::abs(t.boundary_work)});
    state_.error = state_.largest > 0 ? (t.energy() - state_.initial) / state_.largest : 0.0;
  }
  double error() const { return state_.error; }
  const EnergyBookState& state() const { return state_; }
  void restore(const EnergyBookState& state) { state_ = state; }

 private:
  EnergyBookState state_;
};

}  // namespace cairn
