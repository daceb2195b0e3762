#include "estimate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cairn/body/cut_sites.hpp"
#include "cairn/body/piece.hpp"
#include "cairn/core/memory.hpp"
#include "cairn/material/registry.hpp"
#include "cairn/solver/volume.hpp"
#include "report.hpp"

namespace cairn::app {
namespace {

// What a run holds, from measurements (VmHWM) of runs of 7e3 to 1e6 points (tests/app/test_memory.py).
constexpr double base_bytes = 27e6;     // of a rank: program, MPI, HDF5
constexpr double message_copies = 3;    // of what patches exchange: sent and received, with room for more
constexpr double contact_bytes = 550;   // of a node of two bodies
constexpr double writing_bytes = 10e6;  // of HDF5 at work
constexpr double site_bytes = 64;       // while round surfaces are cut

double bytes_of_point(const Material& material, int dimension) {
  const std::size_t states =
      std::visit([](const auto& law) { return law.state_names.size(); }, make_law(material.model, material.parameters));
  return 8.0 + sizeof(Image) + 8.0 * (states + (dimension == 2 ? PointColumns<2>::state : PointColumns<3>::state));
}

/// Doubles of a node that a run keeps.
double node_columns(const Case& c) {
  const bool again =
      c.solver.stress_update == StressUpdate::both || c.solver.stress_update == StressUpdate::modified_last;
  return 8 + vector_width + (again ? vector_width + (c.domain.dimension == 2 ? 4 : 8) : 0);
}

/// Nodes of a body's pieces, and those among them that patches share; how many points its largest piece has.
struct Extent {
  double nodes = 1, shared = 0, cells_of_piece = 1;
};

Extent extent_of(const Shape& shape, const Domain& d) {
  const Bounds b = bounds(shape);
  std::array<double, 3> cells{1, 1, 1}, cuts{};
  Extent e;
  for (int k = 0; k < d.dimension; ++k) {
    const double h = (d.upper[k] - d.lower[k]) / d.cells[k];
    const int patches = std::max(1, d.cells[k] / d.patch_cells);
    const double low = std::max(b.lower[k], d.periodic[k] ? b.lower[k] : d.lower[k]),
                 high = std::min({b.upper[k], d.periodic[k] ? b.upper[k] : d.upper[k], low + d.upper[k] - d.lower[k]});
    cells[k] = std::max(0.0, high - low) / h;
    const double patch = (d.upper[k] - d.lower[k]) / patches;
    cuts[k] = std::max(0.0, std::ceil((high - d.lower[k]) / patch) - std::floor((low - d.lower[k]) / patch) - 1);
    e.cells_of_piece *= std::min(cells[k], patch / h);
  }
  constexpr double layers = 3;  // of nodes that neighbours share
  for (int k = 0; k < d.dimension; ++k) {
    e.nodes *= cells[k] + layers * (1 + cuts[k]);
    double section = 1;
    for (int j = 0; j < d.dimension; ++j) section *= j == k ? 1 : cells[j] + layers;
    e.shared += 2 * layers * cuts[k] * section;
  }
  return e;
}

/// Nodes of two bodies, for bodies as many and as large: those around their few points of contact.
double contact_nodes(const Case& c, double cells) {
  const auto bodies = static_cast<double>(c.bodies.size());
  if (bodies < 2) return 0;
  const int dim = c.domain.dimension;
  const double radius = 0.5 * std::pow(cells / bodies * (dim == 2 ? 1.27 : 1.91), 1.0 / dim);
  return bodies * (dim == 2 ? 20 * std::sqrt(radius) : 85 * radius);
}

}  // namespace

Estimate estimate(const Case& c, int ranks) {
  const int dim = c.domain.dimension;
  const Domain& d = c.domain;
  const Vec3 h = (d.upper - d.lower).cwiseQuotient(Vec3(d.cells[0], d.cells[1], d.cells[2]));
  const double cell = h[0] * h[1] * (dim == 3 ? h[2] : 1.0);
  const int samples = samples_for(c.bodies.size(), dim);
  Estimate result;
  double stored = 0, stepping = 0, placing = 0, cells = 0;
  for (const auto& body : c.bodies) {
    const Extent e = extent_of(body.shape, d);
    const double filled = volume_of(body.shape, d, samples) / cell, points = filled * c.solver.points_per_cell;
    const double point = bytes_of_point(c.materials[body.material], dim);
    result.points += points, cells += filled, stored += points * point;
    stepping += 8 * e.nodes * node_columns(c) + message_copies * 8 * e.shared * (dim == 2 ? 8 : 11);
    const double piece = std::min(filled, e.cells_of_piece) * c.solver.points_per_cell;
    placing = std::max(placing, piece * (point + site_bytes * (is_round(body.shape) ? 1.9 : 0)));
  }
  stepping += contact_bytes * contact_nodes(c, cells);
  result.bytes = ranks * base_bytes + stored + std::max(stepping, ranks * placing);
  if (c.output.checkpoint.active())
    result.bytes += ranks * writing_bytes + result.points * (40 + 8 * (dim == 2 ? tensor_size<2> : tensor_size<3>));
  else if (c.output.particles.active() || c.output.grains.active() || c.output.contacts.active())
    result.bytes += ranks * writing_bytes;
  return result;
}

std::string size_text(double bytes) {
  if (bytes < 1e9) return fmt::format("{:.3g} MB", bytes / 1e6);
  return fmt::format("{:.3g} GB", bytes / 1e9);
}

void warn_of_memory(double bytes, int ranks) {
  const int here = std::min(ranks, ranks_on_machine());
  const double needed = bytes * here / ranks, free = std::min(available_memory(), here * memory_limit());
  if (needed > free)
    print_warnings(
        {fmt::format("the run needs about {}{}; this machine has {} for it (free memory, control groups, "
                     "ulimit); use larger cells, fewer points per cell, or more machines",
                     size_text(needed), here < ranks ? " here" : "", size_text(free))});
}

}  // namespace cairn::app
