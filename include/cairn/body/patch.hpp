#pragma once
/// Patch: a box of cells and the pieces of bodies in it. All arithmetic of a patch depends on the patch alone.

#include <algorithm>
#include <map>
#include <utility>

#include "cairn/body/piece.hpp"
#include "cairn/body/tool.hpp"
#include "cairn/grid/lattice.hpp"

namespace cairn {

/// Sums over a patch's points and the nodes that it answers for, since the start.
struct PatchLedger {
  double contact_dissipation = 0;  // [J]
  double contact_gain = 0;         // of that, what contact gave at nodes where it gave energy [J]; 0 but for round-off
  double boundary_work = 0;        // done by faces, walls and rigid bodies on deformable ones [J]
  // Taken from velocities by blending with PIC, and what spins had at the start and were given by the nodes [J]. Less
  // what spins have now, it is what was lost: by blending, by relaxing spins, and as their inertia changes.
  double blended_and_spun = 0;
  double filtered = 0;       // taken by the filter of noise, from velocities and spins [J]
  double damped = 0;         // taken by damping, likewise [J]
  double stopped = 0;        // times that a point was kept from crossing a wall
  double contact_nodes = 0;  // nodes with a contact impulse in the last step
  // Points that left the domain, those that were lost and dropped, and what both took along. Of rigid bodies the mass
  // alone counts.
  double points_left = 0, points_lost = 0;
  double mass_left = 0, energy_left = 0;                                 // [kg], [J]
  double momentum_left_x = 0, momentum_left_y = 0, momentum_left_z = 0;  // [kg m/s]
  friend bool operator==(const PatchLedger&, const PatchLedger&) = default;
};

/// One number of the ledger, under the name that it has in files. What moves or keeps a patch goes through this table.
struct LedgerColumn {
  const char* name;
  double PatchLedger::*value;
};
inline constexpr LedgerColumn ledger_columns[] = {{"contact_dissipation", &PatchLedger::contact_dissipation},
                                                  {"contact_gain", &PatchLedger::contact_gain},
                                                  {"boundary_work", &PatchLedger::boundary_work},
                                                  {"blended_and_spun", &PatchLedger::blended_and_spun},
                                                  {"filtered", &PatchLedger::filtered},
                                                  {"damped", &PatchLedger::damped},
                                                  {"stopped", &PatchLedger::stopped},
                                                  {"contact_nodes", &PatchLedger::contact_nodes},
                                                  {"points_left", &PatchLedger::points_left},
                                                  {"points_lost", &PatchLedger::points_lost},
                                                  {"mass_left", &PatchLedger::mass_left},
                                                  {"energy_left", &PatchLedger::energy_left},
                                                  {"momentum_left_x", &PatchLedger::momentum_left_x},
                                                  {"momentum_left_y", &PatchLedger::momentum_left_y},
                                                  {"momentum_left_z", &PatchLedger::momentum_left_z}};

/// What passed between two bodies a < b at a patch's nodes since the contacts were last cleared. A wall counts as a
/// body: its number is that of all bodies plus that of its face.
template <int Dim>
struct ContactSum {
  /// Sum of |impulse| [N s], impulse on a, |impulse| x position, |impulse| x normal (from a to b), impulse (x)
  /// position, |impulse| x way slipped, work of friction [J], |impulse| where it sticks.
  static constexpr int impulse = 1, place = 1 + Dim, normal = 1 + 2 * Dim, moment = 1 + 3 * Dim;
  static constexpr int slip = moment + Dim * Dim, friction = slip + 1, stuck = slip + 2, size = slip + 3;
  std::array<double, size> values{};
};

template <int Dim>
struct Patch {
  PatchId id;
  Box<Dim> cells;                  // its own cells
  Box<Dim> nodes;                  // all nodes its points can touch
  std::vector<Link<Dim>> links;    // neighbours, in the order of sums
  std::vector<Box<Dim>> overlaps;  // for each link, the nodes shared with it, in this patch's frame
  int links_before = 0;            // links whose contributions come before the patch's own
  std::vector<Piece<Dim>> pieces;  // ascending in body; those without points are ghosts
  PatchLedger ledger;
  double pressing = 0;  // sum of |contact force| on deformable bodies in the last step [N]
  double seconds = 0;   // processor time spent on it since the last balance; steers nothing but balance
  std::map<std::pair<int, int>, ContactSum<Dim>> contacts;  // kept where an output asks for them
  std::map<int, ToolSum> tools;                             // by their number; likewise
  // Points of cracks: its own, and copies of those of neighbours within reach; ascending in (crack, index).
  std::vector<CrackPoint<Dim>> cracks;

  Patch(PatchId id_, const Lattice<Dim>& lattice)
      : id(id_), cells(lattice.patch_cells(id_)), nodes(lattice.patch_nodes(id_)) {
    links = lattice.links(id);
    for (const auto& link : links) {
      overlaps.push_back(intersection(nodes, lattice.patch_nodes(link.patch).shifted(link.shift)));
      if (link.patch < id || (link.patch == id && link.shift > Index<Dim>{})) ++links_before;
    }
  }

  /// Whether nothing has to be remembered of it: sums over all patches may leave it out.
  bool blank() const {
    return point_count() == 0 && contacts.empty() && tools.empty() && cracks.empty() && ledger == PatchLedger{};
  }

  /// Takes back what was of the last step alone.
  void forget_last_step() {
    ledger.contact_nodes = 0, pressing = 0;
    for (auto& [tool, sum] : tools) sum.last = {};
  }

  std::int64_t point_count() const {
    std::int64_t n = 0;
    for (const auto& piece : pieces) n += piece.points.size();
    return n;
  }

  /// The piece of a body, made (with `states` state columns) where there is none.
  Piece<Dim>& piece_of(int body, int states) {
    auto at =
        std::lower_bound(pieces.begin(), pieces.end(), body, [](const Piece<Dim>& p, int b) { return p.body < b; });
    if (at == pieces.end() || at->body != body) at = pieces.emplace(at, body, states);
    return *at;
  }
};

}  // namespace cairn
