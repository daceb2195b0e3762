#pragma once
/// Points that left their patch go to the same body's piece in the patch where they are now.
///
/// They are appended in the order (patch they come from, order there), so that pieces are the same on any number of
/// ranks. Positions are wrapped at periodic boundaries and the crossings counted in the points' images.

#include <string>

#include "cairn/body/patch.hpp"
#include "cairn/parallel/communicator.hpp"

namespace cairn {

template <int Dim>
class Migration {
 public:
  /// \param owner  the rank of every patch; must outlive this object unchanged
  Migration(NeighbourExchange& messages, const std::vector<int>& owner) : messages_(messages), owner_(owner) {}

  /// A migration: `begin`, `collect` for every piece, `start`, `finish`.
  void begin();
  /// Takes out the points that left the patch. Pieces left without points stay as ghosts. A point that left the domain,
  /// is not finite or moved further than a neighbouring patch stays where it is and is reported by `failure`.
  void collect(Patch<Dim>& patch, Piece<Dim>& piece, const Lattice<Dim>& lattice);
  void start() { messages_.start(); }
  /// Receives those that arrived. Pieces that get points are no longer `projected`.
  void finish(std::vector<Patch<Dim>>& patches);
  /// What went wrong on this rank since `begin`; empty if nothing.
  const std::string& failure() const { return failure_; }

 private:
  NeighbourExchange& messages_;
  const std::vector<int>& owner_;
  std::string failure_;
};

/// True where every point of the piece lies in its patch: what is found almost always, and fast.
template <int Dim>
bool all_inside(const Piece<Dim>& piece, const Lattice<Dim>& lattice, int patch);

/// Sorts the points of a piece by cell, keeping the order within a cell. It is no longer `projected`.
template <int Dim>
void sort_by_cell(Piece<Dim>& piece, const Lattice<Dim>& lattice, const Box<Dim>& cells);

}  // namespace cairn
