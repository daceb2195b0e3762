#pragma once
/// The step as data: what patches do in it, and what they tell each other in between.

#include <cstddef>
#include <string_view>
#include <vector>

#include "cairn/body/patch.hpp"
#include "cairn/parallel/communicator.hpp"

namespace cairn {

template <int Dim>
class Simulation;

/// What patches send each other at the end of a round.
enum class Sent { sums, forces, momenta, points };

/// What one patch does by itself.
template <int Dim>
struct StepStage {
  std::string_view name, does;
  int passes;  // over the points
  void (Simulation<Dim>::*compute)(std::size_t p, Patch<Dim>& patch);
};

/// What is done patch by patch, while a patch's data stays in cache, and then sent.
template <int Dim>
struct StepRound {
  std::vector<StepStage<Dim>> stages;
  Sent sent;
  Traffic traffic = {};  // of this rank so far
};

}  // namespace cairn
