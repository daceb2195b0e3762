// Tips that grow: a segment at a time, from the state of the nodes between two steps. Growth changes the cracks'
// geometry and nothing else, so that no material point changes its field without its stress.

#include <map>

#include "cairn/solver/simulation.hpp"

namespace cairn {
namespace {

constexpr double thinnest = 1.0;  // cells of material ahead of a tip that break at once
constexpr double too_near = 0.5;  // cells between a tip and the crack that it joins
constexpr double beyond = 0.05;   // cells by which it goes beyond that crack's line, so that none slips through
constexpr double slope = 0.55;    // of the share of a full body across its surface, for each cell
constexpr double own_line = 2.0;  // cells of its own line that a tip does not meet

/// Whether a tip's criterion is met; steady growth begins or goes on.
bool is_driven(const GrowthSpec& growth, const TipState<2>& tip, Crack& crack, double segment, double time) {
  const int end = tip.tip.end;
  if (growth.criterion == GrowthCriterion::hoop)
    return largest_hoop_stress(tip.K_opening, tip.K_sliding).intensity >= growth.toughness;
  if (growth.criterion == GrowthCriterion::energy) return tip.J >= growth.energy;
  double& since = crack.since[end];
  const bool begins = growth.energy > 0 ? tip.J >= growth.energy : time >= growth.start;
  if (since < 0 && begins) since = time;
  return since >= 0 && growth.speed * (time - since) >= crack.grown[end] + segment;
}

}  // namespace

/// By how much a tip grows, and what it is then.
template <int Dim>
struct Simulation<Dim>::Advance {
  int crack, end;
  Vec<Dim> by = Vec<Dim>::Zero();  // [m]
  bool open = true, joined = false;
};

/// The tips that grow now, the same on every rank; `by` holds the direction alone until obstacles are known.
template <int Dim>
auto Simulation<Dim>::find_advances() -> std::vector<Advance> {
  std::vector<Advance> advances;
  if constexpr (Dim == 2) {
    const double h = lattice_.smallest_spacing();
    for (const TipState<2>& tip : tip_states()) {
      const GrowthSpec& growth = growth_[tip.tip.crack];
      Crack& crack = cracks_[tip.tip.crack];
      const double segment = growth.length * h;
      if (growth.criterion == GrowthCriterion::none || steps_ % growth.every != 0) continue;
      if (crack.grown[tip.tip.end] + 0.999 * segment > growth.most) continue;
      if (!is_driven(growth, tip, crack, segment, time_)) continue;
      double angle = 0;
      if (growth.direction == GrowthDirection::hoop) angle = largest_hoop_stress(tip.K_opening, tip.K_sliding).angle;
      if (!std::isfinite(angle)) angle = 0;
      const Vec<2> ahead = tip.tip.ahead, left(-ahead.y(), ahead.x());
      advances.push_back({tip.tip.crack, tip.tip.end, std::cos(angle) * ahead + std::sin(angle) * left});
    }
  }
  return advances;
}

/// What lies ahead of the tips is known to the patch whose cells hold the place a cell ahead: other cracks, or the end
/// of the body. Where there is no such patch, there is no material.
template <int Dim>
void Simulation<Dim>::meet_obstacles(std::vector<Advance>& advances) {
  const double h = lattice_.smallest_spacing();
  std::vector<double> mine;
  for (auto& patch : patches_)
    for (const auto& point : patch.cracks)
      for (std::size_t a = 0; a < advances.size(); ++a) {
        const Advance& to = advances[a];
        if (point.crack != to.crack || point.index != cracks_[to.crack].ends[to.end]) continue;
        const Vec<Dim> ahead = point.plane + thinnest * h * to.by;
        Index<Dim> cell;
        for (int d = 0; d < Dim; ++d) cell[d] = static_cast<int>(std::floor(lattice_.scaled(d, ahead[d])));
        if (!patch.cells.contains(cell)) continue;
        const auto around = surroundings_of(patch);
        const double segment = growth_[to.crack].length * h, reach = segment + too_near * h;
        const double met =
            reach * around.segments.first_meeting(point.plane, point.plane + reach * to.by, to.crack, own_line * h);
        const double fill = fill_at(around, to.crack, ahead);
        if (met <= reach)
          mine.insert(mine.end(), {static_cast<double>(a), met + beyond * h, 1, 1});
        else if (fill >= 0.5)
          mine.insert(mine.end(), {static_cast<double>(a), segment, 0, 0});
        else  // the surface lies before that place by what is missing there
          mine.insert(mine.end(), {static_cast<double>(a), std::max(0.1, thinnest - (0.5 - fill) / slope) * h, 1, 0});
      }
  const auto all = gather_on_all(mine, comm_);
  std::vector<bool> seen(advances.size(), false);
  const auto set = [&](std::size_t a, double length, bool open, bool joined) {
    if (!seen[a]) advances[a].by *= length, advances[a].open = open, advances[a].joined = joined;
    seen[a] = true;
  };
  for (std::size_t i = 0; i < all.size(); i += 4)
    set(static_cast<std::size_t>(all[i]), all[i + 1], all[i + 2] != 0, all[i + 3] != 0);
  for (std::size_t a = 0; a < advances.size(); ++a) set(a, 0.5 * thinnest * h, true, false);
}

/// Adds a point behind the old end, for every patch that knows it; the exchange of cracks gives it to its patch.
template <int Dim>
void Simulation<Dim>::advance(const Advance& to) {
  Crack& crack = cracks_[to.crack];
  const int old = crack.ends[to.end], now = old + (to.end == 0 ? -1 : 1) * CrackPoint<Dim>::index_step;
  crack.ends[to.end] = now, crack.open[to.end] = to.open, crack.joined[to.end] = to.joined;
  crack.grown[to.end] += to.by.norm();
  for (auto& patch : patches_) {
    const auto at = std::ranges::find_if(
        patch.cracks, [&](const CrackPoint<Dim>& p) { return p.own && p.crack == to.crack && p.index == old; });
    if (at == patch.cracks.end()) continue;
    CrackPoint<Dim> point = *at;
    point.index = now, point.next = to.end == 0 ? old : now;
    point.plane = point.lower = point.upper = at->plane + to.by;
    if (to.end == 1) at->next = now;
    point.bond = {};
    if (growth_[to.crack].cohesive) {
      // Where it joins a crack the new point lies beyond that one, and never opens.
      const double theirs = to.joined ? 0.0 : 0.5 * to.by.norm();
      if (!to.joined) point.bond.state = Bond::holds, point.bond.length = theirs;
      if (at->bond.state == Bond::none) at->bond.state = Bond::holds;
      at->bond.length += to.by.norm() - theirs;
    }
    patch.cracks.insert(to.end == 0 ? at : at + 1, point);
  }
}

template <int Dim>
void Simulation<Dim>::grow_cracks() {
  const auto due = [&](const GrowthSpec& growth) {
    return growth.criterion != GrowthCriterion::none && steps_ % growth.every == 0;
  };
  if (steps_ == 0 || std::ranges::none_of(growth_, due)) return;
  if (Dim == 3) return grow_rims();
  auto advances = find_advances();
  if (advances.empty()) return;
  meet_obstacles(advances);
  for (const Advance& to : advances) advance(to);
  receive_cracks();
}

template void Simulation<2>::grow_cracks();
template void Simulation<3>::grow_cracks();

}  // namespace cairn
