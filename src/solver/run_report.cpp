#include "run_report.hpp"

#include <fmt/format.h>

#include "cairn/core/say.hpp"

namespace cairn {
namespace {

std::string shares_of_time(const StageTimers& timers) {
  double total = 0;
  std::string shares;
  for (std::size_t s = 0; s + 1 < stage_names.size(); ++s) total += timers.seconds(static_cast<Stage>(s));
  for (std::size_t s = 0; s + 1 < stage_names.size(); ++s)
    shares += fmt::format(" {} {:.1f} %", stage_names[s],
                          100 * timers.seconds(static_cast<Stage>(s)) / std::max(total, 1e-30));
  return shares;
}

}  // namespace

template <int Dim>
void report_run(const Simulation<Dim>& simulation, bool profile, RunSummary s, MPI_Comm comm) {
  std::int64_t points = 0;
  for (const auto& patch : simulation.patches()) points += patch.point_count();
  const std::int64_t mine[3] = {simulation.traffic().messages, simulation.traffic().bytes, points};
  std::int64_t most[3] = {0, 0, 0};
  MPI_Reduce(mine, most, 3, MPI_INT64_T, MPI_MAX, 0, comm);
  MPI_Reduce(&points, &s.points, 1, MPI_INT64_T, MPI_SUM, 0, comm);
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  if (rank != 0) return;
  say(stdout, "time of rank 0:{}\n", shares_of_time(simulation.timers()));
  if (profile) {
    const double steps = std::max(1.0, static_cast<double>(s.steps));
    say(stdout, "sent by rank 0: {:.1f} messages and {:.0f} bytes a step\n", mine[0] / steps, mine[1] / steps);
    for (const auto& round : simulation.schedule())
      say(stdout, "  after {}: {:.1f} messages and {:.0f} bytes a step\n", round.stages.back().name,
          round.traffic.messages / steps, round.traffic.bytes / steps);
    say(stdout, "most sent by a rank: {:.1f} messages and {:.0f} bytes a step\n", most[0] / steps, most[1] / steps);
    const double mean = std::max(1.0, static_cast<double>(s.points)) / s.ranks;
    say(stdout, "balance: largest over mean points {:.3f}, patches moved {} times", static_cast<double>(most[2]) / mean,
        simulation.times_balanced());
    if (simulation.times_balanced() > 0)
      say(stdout, ", in the time of {:.2g} steps each",
          simulation.seconds_balancing() / simulation.times_balanced() / (s.step_wall / steps));
    say(stdout, "\n");
  }
  s.point_steps = static_cast<double>(s.steps) * static_cast<double>(s.points);
  say(stdout, "{}\n", format_summary(s));
}

template void report_run(const Simulation<2>&, bool, RunSummary, MPI_Comm);
template void report_run(const Simulation<3>&, bool, RunSummary, MPI_Comm);

}  // namespace cairn
