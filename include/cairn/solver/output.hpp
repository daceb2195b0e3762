#pragma once
/// Result files of a run, as columns of the simulation's state. Names and layout: docs/results.md.

#include <filesystem>

#include "cairn/solver/simulation.hpp"

namespace cairn {

/// Writes the material points with the fields asked for; `stress_smooth` uses the nodes, and is not to be asked for
/// after a step that failed. Collective.
template <int Dim>
void write_particles(Simulation<Dim>& simulation, const std::filesystem::path& file,
                     const std::vector<std::string>& fields);

/// Writes one row for each crack point: plane, faces, opening. Collective.
template <int Dim>
void write_cracks(const Simulation<Dim>& simulation, const std::filesystem::path& file);

/// Writes one row for each tip of a crack: where it is, J and stress intensities. Collective.
template <int Dim>
void write_tips(Simulation<Dim>& simulation, const std::filesystem::path& file);

/// Writes one row for each body. Collective.
template <int Dim>
void write_grains(const Simulation<Dim>& simulation, const std::filesystem::path& file);

/// Writes one row for each touching pair, forces averaged over `duration` [s]. Collective.
template <int Dim>
void write_contacts(const Simulation<Dim>& simulation, const std::filesystem::path& file, double duration);

}  // namespace cairn
