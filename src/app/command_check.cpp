#include <fmt/format.h>

#include <cmath>

#include "cairn/body/points.hpp"
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

double bytes_of_point(const Material& material, int dimension) {
  const std::size_t states =
      std::visit([](const auto& law) { return law.state_names.size(); }, make_law(material.model, material.parameters));
  return 16.0 + 8.0 * (states + (dimension == 2 ? PointColumns<2>::state : PointColumns<3>::state));
}

/// Points from the volumes, memory from the points and the nodes that the bodies reach.
Estimate estimate(const Case& c) {
  const int dim = c.domain.dimension;
  const Domain& d = c.domain;
  constexpr double node_columns[] = {12, 16};
  const Vec3 h = (d.upper - d.lower).cwiseQuotient(Vec3(d.cells[0], d.cells[1], d.cells[2]));
  const double cell = h[0] * h[1] * (dim == 3 ? h[2] : 1.0);
  const int samples = samples_for(c.bodies.size(), dim);
  Estimate result;
  for (const auto& body : c.bodies) {
    const Bounds b = bounds(body.shape);
    double nodes = 1;
    for (int k = 0; k < dim; ++k) nodes *= std::min(b.upper[k] - b.lower[k], d.upper[k] - d.lower[k]) / h[k] + 4;
    const double points = volume_of(body.shape, d, samples) / cell * c.solver.points_per_cell;
    result.points += points;
    result.bytes += nodes * 8 * node_columns[dim - 2] + 1.25 * points * bytes_of_point(c.materials[body.material], dim);
  }
  return result;
}

std::string size_text(double bytes) {
  if (bytes < 1e9) return fmt::format("{:.3g} MB", bytes / 1e6);
  return fmt::format("{:.3g} GB", bytes / 1e9);
}

void print_summary(const Case& c) {
  const Domain& d = c.domain;
  const Estimate e = estimate(c);
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
  fmt::print("  points     about {:.0f}\n", e.points);
  fmt::print("  memory     about {} in all\n", size_text(e.bytes));
  const FirstStep first = first_step(c);
  if (!std::isfinite(first.dt)) return;
  const double steps = std::min(std::ceil(c.time.end / first.dt * (1 - 1e-9)), static_cast<double>(c.time.steps));
  fmt::print("  first step {:.4g} s ({:.2g} of what a wave and a point take through a cell)\n", first.dt,
             first.dt / first.crossing);
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
