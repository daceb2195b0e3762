#pragma once
/// What of a body hangs together: all rows of nodes that one material point touches belong to one part.

#include <map>

#include "cairn/solver/simulation.hpp"

namespace cairn {

/// One number for a node, whatever the patch.
template <int Dim>
std::int64_t name_of_node(const Lattice<Dim>& lattice, const Index<Dim>& place);

/// A row as all patches name it.
struct RowName {
  std::int64_t body, place, sides;
  friend auto operator<=>(const RowName&, const RowName&) = default;
};

/// The parts of a piece: the rows that its points touch, and which of them hang together within it.
template <int Dim>
class PieceParts {
 public:
  /// \param sides  of the piece's further rows, by their number; none: cracks are passed over
  PieceParts(const Piece<Dim>& piece, const Lattice<Dim>& lattice, const std::vector<SideSet>& sides);

  /// For each point the smallest id of its part.
  const std::vector<std::int64_t>& labels() const { return label_of_point_; }

  /// Calls f(place, sides, label) for every row.
  template <class F>
  void for_rows(F&& f) const {
    for (std::size_t i = 0; i < base_.size(); ++i)
      if (base_[i] >= 0) f(box_.place(static_cast<int>(i)), SideSet(), least_.at(root(base_[i])));
    for (const auto& [name, set] : further_) f(name.first, SideSet(name.second), least_.at(root(set)));
  }

  /// Appends body, node, sides and label of the rows that other patches know too, and of one row of every other part.
  void tell_shared_rows(const Patch<Dim>& patch, const Lattice<Dim>& lattice, std::vector<std::int64_t>& rows) const;

 private:
  int& row(const Index<Dim>& place, SideSet sides);
  int root(int i) const {
    while (up_[i] != i) i = up_[i];
    return i;
  }

  int body_;
  Box<Dim> box_;           // of what the points touch
  std::vector<int> base_;  // the sets of rows without sides in the box; -1: no point touches it
  std::map<std::pair<Index<Dim>, std::int64_t>, int> further_;
  std::vector<int> up_;  // sets that are united, each known by its smallest member
  std::map<int, std::int64_t> least_;
  std::vector<std::int64_t> label_of_point_;
};

/// The part that a label of some piece belongs to: its body and its smallest label.
struct Part {
  std::int64_t body, label;
};
using JoinedParts = std::map<std::int64_t, Part>;

/// Makes one part of those that share a row in different patches, from what all patches told.
JoinedParts join_parts(const std::vector<std::int64_t>& rows);

/// Of every deformable body that is in several parts, and that no crack cuts, their number. Collective; the result is
/// valid on rank 0.
template <int Dim>
std::map<std::int64_t, int> bodies_in_parts(const Simulation<Dim>& simulation);

}  // namespace cairn
