#pragma once
/// The background lattice and its division into patches. A patch is a box of cells: the unit of distribution and of
/// load balance. Patch size belongs to the case, never to the rank count.

#include <cmath>
#include <cstdint>
#include <vector>

#include "cairn/core/types.hpp"
#include "cairn/grid/box.hpp"

namespace cairn {

/// A patch by its place among all patches that the lattice has room for, x fastest: most of them may be empty, and only
/// those within reach of points exist as a Patch.
using PatchId = std::int64_t;

/// A neighbour of a patch: one that shares nodes with it, directly or across a periodic boundary.
template <int Dim>
struct Link {
  PatchId patch;       // the neighbour
  Index<Dim> shift{};  // node i of this patch is node i - shift of the neighbour (0 or +-cells in periodic directions)
  int mirror = -1;     // position in the neighbour's list of the link back
};

template <int Dim>
class Lattice {
 public:
  /// Patches have at least `patch_cells` cells in each direction (all of them where there are fewer).
  Lattice(const Vec<Dim>& lower, const Vec<Dim>& upper, const Index<Dim>& cells, const std::array<bool, Dim>& periodic,
          int patch_cells);

  const Vec<Dim>& lower() const { return lower_; }
  const Vec<Dim>& upper() const { return upper_; }
  const Vec<Dim>& spacing() const { return spacing_; }          // cell size [m]
  const Vec<Dim>& inverse_spacing() const { return inverse_; }  // [1/m]
  const Index<Dim>& cells() const { return cells_; }
  bool periodic(int d) const { return periodic_[d]; }
  double cell_volume() const { return spacing_.prod(); }  // [m^Dim]
  double smallest_spacing() const { return spacing_.minCoeff(); }
  double length(int d) const { return upper_[d] - lower_[d]; }

  /// Position in cells from the lower corner along `d`.
  double scaled(int d, double x) const { return (x - lower_[d]) * inverse_[d]; }
  double node_position(int d, int i) const { return lower_[d] + i * spacing_[d]; }

  /// The whole periods by which a position is away from another one [m]; 0 in a direction that is not periodic.
  double periods_between(int d, double x, double other) const {
    return periodic_[d] ? length(d) * std::round((x - other) / length(d)) : 0.0;
  }
  /// Brings a position [m] that is less than a period outside a periodic direction inside, a rounding error short of a
  /// face onto the last position inside; others stay. Returns the periods taken off: -1, 0 or 1.
  int wrap(int d, double& x) const;

  /// Gives the domain another upper corner [m]; cells and patches stay.
  void set_upper(const Vec<Dim>& upper);

  PatchId patch_count() const { return patch_count_; }
  Index<Dim> patch_position(PatchId patch) const;
  PatchId patch_at(const Index<Dim>& position) const;
  Box<Dim> patch_cells(PatchId patch) const;
  /// Nodes that points of the patch can touch with any shape function: one beyond its cells on every side, two at a
  /// face.
  Box<Dim> patch_nodes(PatchId patch) const;
  /// Where points may be, in cells from the lower corner along `d`: in the patch's cells, and half a cell beyond a face
  /// of the domain, since contact with a wall is as soft as the material.
  std::array<double, 2> patch_reach(PatchId patch, int d) const;
  /// The patch that holds a cell inside the lattice.
  PatchId patch_of_cell(const Index<Dim>& cell) const;
  /// True where the patch answers for the node in sums over nodes: every node has one such patch.
  bool owns_node(PatchId patch, const Index<Dim>& node) const;
  /// Neighbours of a patch in ascending order of (patch, -shift): the order in which shared nodes are summed. A
  /// periodic direction with one patch makes a patch its own neighbour.
  std::vector<Link<Dim>> links(PatchId patch) const;
  /// The same without the links back.
  std::vector<Link<Dim>> unpaired_links(PatchId patch) const;

 private:
  void measure();  // spacing and what follows from it
  double last_inside(int d) const;

  Vec<Dim> lower_, upper_, spacing_, inverse_;
  Vec<Dim> last_;  // the largest position that is inside [m]
  Index<Dim> cells_;
  std::array<bool, Dim> periodic_;
  /// First cell of the patches with this position along d.
  int cut(int d, int position) const {
    return static_cast<int>(static_cast<std::int64_t>(position) * cells_[d] / patches_[d]);
  }

  Index<Dim> patches_{};  // patches in each direction
  PatchId patch_count_ = 1;
};

}  // namespace cairn
