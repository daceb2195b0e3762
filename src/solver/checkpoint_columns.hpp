#pragma once
/// The columns of a checkpoint, shared by writing and reading.

#include <span>
#include <string>
#include <vector>

#include "cairn/body/patch.hpp"
#include "cairn/io/table_file.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn::checkpoint {

/// Neighbouring columns of the points that make one column of the file.
struct Quantity {
  std::string name;
  int first, components;
};

/// `states`: the most state variables that any material has; points with fewer get zeros.
template <int Dim>
std::vector<Quantity> quantities(int states) {
  using C = PointColumns<Dim>;
  std::vector<Quantity> list = {{"position", C::position, Dim},
                                {"velocity", C::velocity, Dim},
                                {"spin", C::spin, spin_size<Dim>},
                                {"deformation_gradient", C::deformation, tensor_size<Dim>},
                                {"stress", C::stress, symmetric_size<Dim>},
                                {"initial_volume", C::volume, 1}};
  if (states > 0) list.push_back({"state", C::state, states});
  return list;
}

inline int most_states(const std::vector<SolverMaterial>& materials) {
  std::size_t most = 0;
  for (const auto& m : materials) most = std::max(most, m.state_names.size());
  return static_cast<int>(most);
}

inline constexpr int image_components = 3;
inline constexpr const char* checksums_name =
    "checksums";  // for each patch, one of each column in the order of writing
inline constexpr const char* numbers_checksum_name = "numbers_checksum";  // of all else

/// Rows of every patch in some table.
using Counts = std::vector<std::int64_t>;

/// What the file holds of crack points besides their numbers.
template <int Dim>
struct CrackVector {
  const char* name;
  Vec<Dim> CrackPoint<Dim>::*value;
};
template <int Dim>
inline constexpr CrackVector<Dim> crack_vectors[] = {{"crack_plane", &CrackPoint<Dim>::plane},
                                                     {"crack_lower", &CrackPoint<Dim>::lower},
                                                     {"crack_upper", &CrackPoint<Dim>::upper},
                                                     {"crack_lower_velocity", &CrackPoint<Dim>::lower_velocity},
                                                     {"crack_upper_velocity", &CrackPoint<Dim>::upper_velocity},
                                                     {"crack_traction", &CrackPoint<Dim>::traction}};
/// Of a crack point the file holds nine integers, the last three its image, and four numbers of its bond.
enum CrackNumber { crack_of, crack_index, crack_next, crack_filled, crack_faces_filled, bond_state, crack_image };
inline constexpr int crack_numbers = crack_image + image_components;
inline constexpr int bond_numbers = 4;                           // length, peaks, dissipated
inline constexpr int held_numbers = 2 + 3 * CrackHeld<3>::most;  // in 3D: tip, triangles held, what they are
inline constexpr const char* patch_cracks_name = "patch_cracks";
/// Columns that a case with cracks has more.
template <int Dim>
inline constexpr int crack_columns = 3 + (Dim == 3) + static_cast<int>(std::size(crack_vectors<Dim>));

/// The patches that a checkpoint holds: those of which something has to be remembered.
struct Layout {
  std::vector<PatchId> patches;            // ascending
  Counts points, pieces, contacts, tools;  // of each
  std::vector<std::size_t> here;           // places in the list of those of this rank, ascending
  Counts cracks = {};                      // crack points; there is no such table where the case has no cracks

  Counts one_each() const { return Counts(patches.size(), 1); }
  /// Rows of a table in patch order that belong to this rank's patches.
  RowBlocks rows_of(const Counts& counts) const {
    RowBlocks rows;
    auto mine = here.begin();
    for (std::size_t p = 0; p < counts.size(); rows.total_rows += counts[p], ++p) {
      if (mine == here.end() || *mine != p) continue;
      if (counts[p] > 0) rows.blocks.push_back({rows.total_rows, counts[p]});
      ++mine;
    }
    return rows;
  }
  /// Those of this rank's patches (ascending) that are in the list, in its order; `here` becomes their places.
  template <class P>
  std::vector<P*> find(std::vector<P>& all) {
    return find_in<P>(all);
  }
  template <class P>
  std::vector<const P*> find(const std::vector<P>& all) {
    return find_in<const P>(all);
  }

 private:
  template <class P, class List>
  std::vector<P*> find_in(List& all) {
    std::vector<P*> found;
    here.clear();
    auto patch = all.begin();
    for (std::size_t p = 0; p < patches.size(); ++p) {
      while (patch != all.end() && patch->id < patches[p]) ++patch;
      if (patch != all.end() && patch->id == patches[p]) found.push_back(&*patch), here.push_back(p);
    }
    return found;
  }
};

/// Calls f(piece) for every piece of the patch with points: what a checkpoint holds.
template <int Dim, class F>
void for_filled(const Patch<Dim>& patch, F&& f) {
  for (const auto& piece : patch.pieces)
    if (piece.points.size() > 0) f(piece);
}

}  // namespace cairn::checkpoint
