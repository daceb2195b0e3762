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
  fmt::print("  points     about {:.0f}\n", e.points);
  fmt::print("  memory     about {} in all{}\n", size_text(e.bytes),
             ranks > 1 ? fmt::format(" on {} ranks", ranks) : "");
  warn_of_memory(e.bytes, ranks);
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
