#pragma once
/// The energies' error over the largest energy seen, and no less than an energy that matters: that of lifting all
/// bodies by a cell, and of moving them as fast as drives and faces do. Velocities and positions are half a step apart,
/// so that a body that has just begun to fall has 1/n of its energy too little after n steps, of next to none.

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
  /// \param least  the least energy that matters, of each mass [J/kg]
  explicit EnergyBook(double least = 0) : least_(least) {}
  /// Enters the energies of a row; the first sets what they started from.
  void add(const Totals& t) {
    if (!state_.started) {
      state_.started = 1, state_.initial = t.energy(), state_.initial_potential = t.potential;
      state_.largest = t.deformable_mass * least_;
    }
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
  double least_;
  EnergyBookState state_;
};

}  // namespace cairn
