#include "memory.hpp"

#include <fmt/format.h>

#include <string>

#include "cairn/body/piece.hpp"
#include "cairn/core/error.hpp"
#include "cairn/core/memory.hpp"
#include "cairn/io/agreement.hpp"

namespace cairn {

namespace {

std::string shortage(double needed, double available, const std::string& who, const std::string& where) {
  if (needed <= available) return {};
  return fmt::format(
      "{} at least {:.3g} GB of memory, {} {:.3g} GB; use larger cells, fewer points per cell, or more machines", who,
      1e-9 * needed, where, 1e-9 * available);
}

}  // namespace

template <int Dim>
double estimated_memory(std::int64_t points, const SolverOptions& solver, bool extras) {
  constexpr double point = 8.0 * PointColumns<Dim>::state + sizeof(std::int64_t) + sizeof(Image);
  const double node =
      8.0 * (NodeSums<Dim>::width + 2 * vector_width + NodeMotion<Dim>::width + (extras ? NodeExtras<Dim>::width : 0));
  return static_cast<double>(points) * (point + node / solver.points_per_cell);
}
template double estimated_memory<2>(std::int64_t, const SolverOptions&, bool);
template double estimated_memory<3>(std::int64_t, const SolverOptions&, bool);

void require_memory(double bytes, MPI_Comm comm) {
  MPI_Comm machine = MPI_COMM_NULL;
  MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
  int ranks = 1;
  double all = 0;
  MPI_Comm_size(machine, &ranks);
  MPI_Allreduce(&bytes, &all, 1, MPI_DOUBLE, MPI_SUM, machine);
  MPI_Comm_free(&machine);
  std::string problem =
      shortage(all, available_memory(),
               fmt::format("the {} rank{} of this machine need{}", ranks, ranks == 1 ? "" : "s", ranks == 1 ? "s" : ""),
               "it has free");
  if (problem.empty()) problem = shortage(bytes, memory_limit(), "a rank needs", "its limit (ulimit -v, -m) is");
  problem = common_error(comm, problem);
  if (!problem.empty()) throw InputError(problem);
}

}  // namespace cairn
