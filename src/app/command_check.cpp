#include <fmt/format.h>
#include <mpi.h>

#include <cmath>

#include "cairn/body/cut_sites.hpp"
#include "cairn/body/piece.hpp"
#include "cairn/core/memory.hpp"
#include "cairn/core/printable.hpp"
#include "cairn/io/first_step.hpp"
#include "cairn/material/registry.hpp"
#include "cairn/solver/volume.hpp"
#include "commands.hpp"
#include "report.hpp"

namespace cairn::app {
namespace {

struct Estimate {
  double points = 0, bytes = 0;
};

// What a run holds, from measurements (VmHWM) of runs of 7e3 to 1e6 points (tests/app/test_memory.py).
constexpr double base_bytes = 24e6;     // of a rank: program, MPI, HDF5
constexpr double message_copies = 3;    // of what patches exchange: sent and received, with room for more
constexpr double contact_bytes = 550;   // of a node of two bodies
constexpr double writing_bytes = 10e6;  // of HDF5 at work
constexpr double site_bytes = 32;       // while round surfaces are cut

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

/// Points from the volumes; memory from the points, the nodes that the bodies reach and what travels between patches.
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

/// Says where the machine, or the process, cannot give what the run needs.
void warn_of_memory(double bytes, int ranks) {
  const double free = std::min(available_memory(), ranks * memory_limit());
  if (bytes > free)
    print_warnings(
        {fmt::format("the run needs about {}; this machine has {} for it (free memory, control groups, "
                     "ulimit); use larger cells, fewer points per cell, or more machines",
                     size_text(bytes), size_text(free))});
}

std::string bounds_text(const Bounds& b, int dimension) {
  std::string lower, upper;
  for (int k = 0; k < dimension; ++k) {
    lower += fmt::format("{}{:.4g}", k ? ", " : "", b.lower[k]);
    upper += fmt::format("{}{:.4g}", k ? ", " : "", b.upper[k]);
  }
  return fmt::format("[{}] to [{}]", lower, upper);
}

/// What the case file does not show of shapes that come from files: size, place, and how well the cells resolve them.
void print_shapes(const Case& c) {
  constexpr int most = 10;  // said one by one
  const double cell = smallest_cell(c.domain);
  const char* unit = c.domain.dimension == 2 ? "m2" : "m3";
  int shown = 0, labels = 0;
  double least = 0, largest = 0, thinnest = 0;
  for (std::size_t i = 0; i < c.bodies.size(); ++i) {
    const Shape& shape = c.bodies[i].shape;
    const double volume = known_volume(shape), width = smallest_width(shape) / cell;
    if (volume < 0) continue;
    if (std::holds_alternative<LabelBody>(shape)) {
      least = labels ? std::min(least, volume) : volume, largest = std::max(largest, volume);
      thinnest = labels++ ? std::min(thinnest, width) : width;
    } else if (shown++ < most) {
      fmt::print("  body {:<5} volume {:.6g} {}, {}, thinnest part {:.3g} cells\n", i, volume, unit,
                 bounds_text(bounds(shape), c.domain.dimension), width);
    }
  }
  if (shown > most) fmt::print("             ... and {} more from files\n", shown - most);
  if (labels > 0)
    fmt::print("  labels     {} bodies, volumes {:.4g} to {:.4g} {}, the thinnest {:.3g} cells across\n", labels, least,
               largest, unit, thinnest);
}

void print_summary(const Case& c) {
  const Domain& d = c.domain;
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const Estimate e = estimate(c, ranks);
  std::string cells, periodic;
  for (int k = 0; k < d.dimension; ++k) {
    cells += fmt::format("{}{}", k ? " x " : "", d.cells[k]);
    if (d.periodic[k]) periodic += fmt::format("{}{}", periodic.empty() ? ", periodic in " : " and ", "xyz"[k]);
  }
  fmt::print("{}: ok\n", printable(c.file.string()));
  if (!c.title.empty()) fmt::print("  title      {}\n", printable(c.title));
  fmt::print("  dimension  {}{}\n", d.dimension, periodic);
  fmt::print("  cells      {}\n", cells);
  fmt::print("  bodies     {} of {} material{}\n", c.bodies.size(), c.materials.size(),
             c.materials.size() == 1 ? "" : "s");
  print_shapes(c);
  fmt::print("  points     about {:.0f}\n", e.points);
  fmt::print("  memory     about {} in all{}\n", size_text(e.bytes),
             ranks > 1 ? fmt::format(" on {} ranks", ranks) : "");
  warn_of_memory(e.bytes, ranks);
  const FirstStep first = first_step(c);
  if (!std::isfinite(first.dt)) return;
  const double steps = std::min(std::ceil(c.time.end / first.dt * (1 - 1e-9)), static_cast<double>(c.time.steps));
  fmt::print("  first step {:.4g} s ({:.2g} of what a wave and a point take through a cell)\n", first.dt,
             first.dt / first.crossing);
  if (c.time.steps == Time{}.steps && !std::isfinite(c.time.end)) return;
  fmt::print("  steps      {:.0f}{}\n", steps, c.time.dt > 0 ? "" : ", if steps stay as long");
}

}  // namespace

int command_check(const std::filesystem::path& file, const std::vector<Override>& overrides) {
  return on_first_rank([&] {
    const Case c = read_case(file, overrides);
    print_summary(c);
    print_warnings(c.warnings);
  });
}

}  // namespace cairn::app
