#pragma once
/// What a run is besides its points: everything a checkpoint holds that is no column.

#include <cstdint>
#include <vector>

#include "cairn/io/history.hpp"
#include "cairn/io/table_file.hpp"
#include "cairn/solver/energy_book.hpp"
#include "cairn/solver/output_clock.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {

struct RunState {
  StepState step;
  ClockState particles, grains, contacts, forces, tips, history, checkpoint;
  EnergyBookState energy;
  double contacts_cleared = 0;     // time since which contacts are summed [s]
  std::int64_t contacts_kept = 0;  // 1 where they are summed at all
  double wall = 0;                 // of the run so far [s]; 0 unless an output depends on it
  CsvPosition history_file, bodies_file, forces_file, tips_file;
  std::uint64_t bodies = 0;                // bodies_checksum of the case
  std::vector<SeriesIndex::Entry> series;  // of the particle files
  std::vector<double> cracks;              // Crack::state_size numbers for each
  std::vector<double> parts;               // bodies from which further ones were split off, in their order
  std::vector<double> spared;              // pairs of a crack and a body that it does not cut any more
  std::vector<double> stage;               // of the StageKeeper
  std::vector<double> pouring;             // of the simulation
  std::vector<double> tools;               // tool_state_size numbers for each: travel, velocity, spin, speed
};

/// Notes what a simulation is besides its patches. Collective.
template <int Dim>
void note_simulation(Simulation<Dim>& simulation, RunState& state) {
  state.step = simulation.step_state();
  state.tools = simulation.tool_states(), state.cracks = simulation.crack_states();
  state.parts = simulation.parts(), state.spared = simulation.spared();
  state.pouring = simulation.pouring();
}

/// Calls f(name, number) for every number of the state: doubles, std::int64_t and std::uint64_t. Time and step come
/// first.
template <class State, class F>
void for_each_number(State& s, F&& f) {
  f("kinetic", s.step.kinetic[0]), f("kinetic_before", s.step.kinetic[1]);
  f("upper_x", s.step.upper[0]), f("upper_y", s.step.upper[1]), f("upper_z", s.step.upper[2]);
  f("rate_x", s.step.needed_rates[0]), f("rate_y", s.step.needed_rates[1]), f("rate_z", s.step.needed_rates[2]);
  f("dt", s.step.dt), f("wave_speed", s.step.wave_speed), f("point_speed", s.step.point_speed);
  const auto clock = [&](const std::string& name, auto& c) {
    f(name + "_last_step", c.last_step), f(name + "_last_time", c.last_time);
    f(name + "_last_wall", c.last_wall), f(name + "_count", c.count);
  };
  clock("particles", s.particles), clock("grains", s.grains), clock("contacts", s.contacts), clock("forces", s.forces);
  clock("tips", s.tips), clock("history", s.history), clock("checkpoint", s.checkpoint);
  f("energy_started", s.energy.started), f("energy_initial", s.energy.initial);
  f("energy_initial_potential", s.energy.initial_potential), f("energy_largest", s.energy.largest);
  f("energy_error", s.energy.error);
  f("contacts_cleared", s.contacts_cleared), f("contacts_kept", s.contacts_kept), f("wall", s.wall);
  f("history_bytes", s.history_file.bytes), f("history_checksum", s.history_file.checksum);
  f("bodies_bytes", s.bodies_file.bytes), f("bodies_checksum", s.bodies_file.checksum);
  f("forces_bytes", s.forces_file.bytes), f("forces_checksum", s.forces_file.checksum);
  f("tips_bytes", s.tips_file.bytes), f("tips_checksum", s.tips_file.checksum);
  f("case_bodies", s.bodies);
}

}  // namespace cairn
