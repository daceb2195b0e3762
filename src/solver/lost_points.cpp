// Points that no step can go on from, and those that leave the run.

#include <fmt/format.h>

#include "cairn/solver/simulation.hpp"
#include "fault.hpp"
#include "point_budget.hpp"

namespace cairn {

/// Notes which point a stage found to be inverted or not finite. What it did to others in later stages does not matter:
/// the most urgent fault of all ranks is the one reported, that of the earliest stage.
template <int Dim>
void Simulation<Dim>::look_for_fault(const StepRound<Dim>& round, int urgency) {
  if (fault_urgency_ > 0 || (std::isfinite(speeds_.wave) && std::isfinite(speeds_.point))) return;
  const Fault fault = find_fault(patches_, bodies_);
  fault_urgency_ = 10 * urgency + fault.kind;
  fault_ = fmt::format("{} (seen after {})", fault.text, round.stages.back().name);
}

/// They take part in the rest of the step as mass without stress, and leave at its end.
template <int Dim>
void Simulation<Dim>::mark_faults(Piece<Dim>& piece) {
  using C = PointColumns<Dim>;
  Points<Dim>& points = piece.points;
  for (int p = 0; p < points.size(); ++p) {
    if (is_lost(points.ids()[p])) continue;
    const Fault fault = fault_of(points, p, piece.body);
    if (fault.kind == Fault::none) continue;
    notes_.push_back(fmt::format("step {}: {}; it is dropped", steps_ + 1, fault.text));
    marked_ = true;
    mark_lost(points.ids()[p]);
    for (int d = 0; d < Dim; ++d) {
      if (!std::isfinite(points.column(d)[p]))
        points.column(d)[p] = lattice_.node_position(d, piece.nodes.box.lower[d] + 1);
      if (!std::isfinite(points.column(C::velocity + d)[p])) points.column(C::velocity + d)[p] = 0;
    }
    for (int c = C::spin; c < C::volume; ++c) points.column(c)[p] = 0;
    for (int i = 0; i < 3; ++i) points.column(C::deformation + tensor_index<Dim>(i, i))[p] = 1;
    for (int c = C::state; c < points.columns(); ++c)
      if (!std::isfinite(points.column(c)[p])) points.column(c)[p] = 0;
  }
}

template <int Dim>
void Simulation<Dim>::book_departures(Patch<Dim>& patch, const Piece<Dim>& piece,
                                      std::span<const Departure> departing) {
  PatchLedger& ledger = patch.ledger;
  for (const auto& [point, lost] : departing) {
    ++(lost.empty() ? ledger.points_left : ledger.points_lost);
    if (!lost.empty() && !is_lost(piece.points.ids()[point]))
      notes_.push_back(fmt::format("step {}: {}; it is dropped", steps_ + 1, lost));
  }
  for_budgets(
      piece, material_of(piece), is_rigid(piece), lattice_, transfer_, static_cast<int>(departing.size()),
      [&](int i) { return departing[i].point; },
      [&](int, const PointBudget& b) {
        ledger.mass_left += b.mass;
        if (!std::isfinite(b.energy())) return;  // no number to book
        ledger.energy_left += b.energy();
        ledger.blended_and_spun -= b.spin;
        ledger.momentum_left_x += b.momentum[0], ledger.momentum_left_y += b.momentum[1];
        ledger.momentum_left_z += b.momentum[2];
      });
}

#define CAIRN_INSTANTIATE(Dim)                                               \
  template void Simulation<Dim>::look_for_fault(const StepRound<Dim>&, int); \
  template void Simulation<Dim>::mark_faults(Piece<Dim>&);                   \
  template void Simulation<Dim>::book_departures(Patch<Dim>&, const Piece<Dim>&, std::span<const Departure>);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
