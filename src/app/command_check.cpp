#include <fmt/format.h>
#include <mpi.h>

#include <cmath>

#include "cairn/core/printable.hpp"
#include "cairn/io/first_step.hpp"
#include "commands.hpp"
#include "estimate.hpp"
#include "report.hpp"

namespace cairn::app {
namespace {

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
