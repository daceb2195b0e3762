// The step of each scheme, and how it is told.

#include "cairn/solver/schedule.hpp"

#include <fmt/format.h>

#include "cairn/core/say.hpp"
#include "cairn/solver/run.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {

template <int Dim>
std::vector<StepRound<Dim>> Simulation<Dim>::schedule_of(StressUpdate update) {
  using S = Simulation;
  const StepStage<Dim> project = {"project_points",
                                  "points -> nodes: mass, momentum, volume, gradient, force; pieces that kept all "
                                  "their points were projected at the end of the step before",
                                  1, &S::project_points};
  const StepStage<Dim> before = {"contact_before_update",
                                 "nodes where bodies, walls or faces of cracks touch; contact of the momenta", 0,
                                 &S::contact_before_update};
  const StepStage<Dim> strain = {
      "strain_first", "nodes -> points -> nodes: strain, stress, the force of the new stress", 1, &S::strain_first};
  const StepStage<Dim> complete = {"complete_forces", "sums of the forces, with those between faces of cracks", 0,
                                   &S::complete_forces};
  const StepStage<Dim> after = {"contact_after_update", "contact of the forces, fixed faces, accelerations", 0,
                                &S::contact_after_update};
  const StepStage<Dim> accelerate = {
      "accelerate_points", "nodes -> points -> nodes: velocity and spin, the new momentum", 1, &S::accelerate_points};
  const StepStage<Dim> again = {"project_again", "contact and faces once more, of that momentum", 0, &S::project_again};
  const StepStage<Dim> finish = {
      "finish_points", "nodes -> points: what is left of velocity, strain and stress; positions", 1, &S::finish_points};
  switch (update) {
    case StressUpdate::last:
      return {{{project}, Sent::sums}, {{before, after, finish}, Sent::points}};
    case StressUpdate::first:
      return {{{project}, Sent::sums}, {{before, strain}, Sent::forces}, {{complete, after, finish}, Sent::points}};
    case StressUpdate::both:
      return {{{project}, Sent::sums},
              {{before, strain}, Sent::forces},
              {{complete, after, accelerate}, Sent::momenta},
              {{again, finish}, Sent::points}};
    case StressUpdate::modified_last:
      return {{{project}, Sent::sums}, {{before, after, accelerate}, Sent::momenta}, {{again, finish}, Sent::points}};
  }
  return {};
}

namespace {

constexpr std::array words_of_sent = {"what patches add to the nodes they share, and further bodies there",
                                      "the forces of the new stress there", "the new momenta there",
                                      "the points that left a patch"};

/// Messages and bytes of all ranks.
std::array<std::int64_t, 2> sum_of(const Traffic& mine, MPI_Comm comm) {
  std::array<std::int64_t, 2> sums = {mine.messages, mine.bytes};
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_INT64_T, MPI_SUM, comm);
  return sums;
}

template <int Dim>
void explain(const Case& c, MPI_Comm comm) {
  constexpr double forever = 1e300;
  Simulation<Dim> simulation(c, comm);
  simulation.step(forever);
  const std::vector<StepRound<Dim>> before = simulation.schedule();
  simulation.step(forever);
  simulation.step_state();  // waits for the ranks' faults
  int rank = 0, ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  std::string text = fmt::format("A step of this case: {} points, {} rank{}\n", simulation.total_points(), ranks,
                                 ranks == 1 ? "" : "s");
  text += fmt::format("  {:24}{}\n", "choose_time_step", "waits for the largest speeds, asked for in the step before");
  int passes = 0;
  std::array<std::int64_t, 2> all{};
  for (std::size_t r = 0; r < before.size(); ++r) {
    const StepRound<Dim>& round = simulation.schedule()[r];
    for (const auto& stage : round.stages)
      text += fmt::format("  {:24}{}\n", stage.name, stage.does), passes += stage.passes;
    const auto sums = sum_of(
        {round.traffic.messages - before[r].traffic.messages, round.traffic.bytes - before[r].traffic.bytes}, comm);
    text += fmt::format("    -> {} message{}, {} bytes: {}\n", sums[0], sums[0] == 1 ? "" : "s", sums[1],
                        words_of_sent[static_cast<std::size_t>(round.sent)]);
    all[0] += sums[0], all[1] += sums[1];
  }
  text += fmt::format("  {:24}{}\n", "receive_points", "points that came from other patches");
  text +=
      fmt::format("{} passes over the points; {} messages and {} bytes between the ranks, counted in the second step\n",
                  passes, all[0], all[1]);
  if (rank == 0) say(stdout, "{}", text);
}

}  // namespace

void explain_step(const Case& c, MPI_Comm comm) { c.domain.dimension == 2 ? explain<2>(c, comm) : explain<3>(c, comm); }

template std::vector<StepRound<2>> Simulation<2>::schedule_of(StressUpdate);
template std::vector<StepRound<3>> Simulation<3>::schedule_of(StressUpdate);

}  // namespace cairn
