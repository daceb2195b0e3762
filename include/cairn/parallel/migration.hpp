#pragma once
/// Points that left their patch go to the same body's piece in the patch where they are now, those that left the domain
/// through an open face leave the run.
///
/// They are appended in the order (patch they come from, order there), so that pieces are the same on any number of
/// ranks. Positions are wrapped at periodic boundaries and the crossings counted in the points' images.

#include <functional>
#include <span>
#include <string>

#include "cairn/body/patch.hpp"
#include "cairn/parallel/communicator.hpp"
#include "cairn/parallel/distribution.hpp"

namespace cairn {

/// A point that leaves the run.
struct Departure {
  int point;         // its place in the piece
  std::string lost;  // why it is lost; empty where it left through an open face
};

/// How points leave the run.
template <int Dim>
struct Exits {
  std::array<bool, 2 * Dim> open{};  // faces through which points leave; face = 2 x direction + side
  bool drop_lost = false;            // lost points leave as well; else they are failures
  /// Books them before they are taken out.
  std::function<void(Patch<Dim>&, const Piece<Dim>&, std::span<const Departure>)> book = [](auto&&...) {};
};

/// Marks a point as lost wherever it is: the next `collect` of its piece takes it out.
inline void mark_lost(std::int64_t& id) { id = -1 - id; }
inline bool is_lost(std::int64_t id) { return id < 0; }

template <int Dim>
class Migration {
 public:
  /// \param table  of all patches; must outlive this object
  Migration(NeighbourExchange& messages, const PatchTable<Dim>& table, Exits<Dim> exits = {})
      : messages_(messages), table_(table), exits_(std::move(exits)) {}

  /// A migration: `begin`, `collect` for every piece, `start`, `finish`.
  void begin();
  /// Takes out the points that left the patch. Pieces left without points stay as ghosts. A point half a cell beyond an
  /// open face leaves the run. One beyond another face, not finite, or moved further than a neighbouring patch is lost:
  /// it leaves the run as well, or stays where it is and is reported by `failure`.
  void collect(Patch<Dim>& patch, Piece<Dim>& piece, const Lattice<Dim>& lattice);
  void start() { messages_.start(); }
  /// Receives those that arrived. Pieces that get points are no longer `projected`.
  void finish(std::vector<Patch<Dim>>& patches);
  /// What went wrong on this rank since `begin`; empty if nothing.
  const std::string& failure() const { return failure_; }
  /// Patches that points of this rank entered since `begin` and that the table does not know as filled.
  const std::vector<PatchId>& entered() const { return entered_; }

 private:
  void send(const Patch<Dim>& patch, const Piece<Dim>& piece, std::vector<std::pair<PatchId, int>>& leaving);

  NeighbourExchange& messages_;
  const PatchTable<Dim>& table_;
  Exits<Dim> exits_;
  std::string failure_;
  std::vector<PatchId> entered_;
};

/// True where every point of the piece lies in its patch: what is found almost always, and fast.
template <int Dim>
bool all_inside(const Piece<Dim>& piece, const Lattice<Dim>& lattice, PatchId patch);

/// Sorts the points of a piece by cell, keeping the order within a cell. It is no longer `projected`.
template <int Dim>
void sort_by_cell(Piece<Dim>& piece, const Lattice<Dim>& lattice, const Box<Dim>& cells);

}  // namespace cairn
