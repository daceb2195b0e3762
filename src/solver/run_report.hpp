#pragma once
/// What a run says at its end.

#include "cairn/io/progress.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {

/// Where rank 0's time went, with `profile` what was sent and how the work was shared out, and the summary, of which
/// `s` has all but the points. Collective.
template <int Dim>
void report_run(const Simulation<Dim>& simulation, bool profile, RunSummary s, MPI_Comm comm);

}  // namespace cairn
