#pragma once
/// Sums of nodal quantities over patches.
///
/// Each patch sends, for every neighbouring patch and every piece that touches nodes both share, the box of shared
/// nodes and the piece's own contributions there; it receives the like. A body that only the neighbour knows arrives as
/// a ghost piece. Contributions are added in ascending order of (patch, the contributor's own node position), the
/// patch's own included, so that every patch finds the same bits, wherever patches live. Further rows of the shared
/// nodes (cracks) travel and are summed alike, and come as ghosts do. All messages between two ranks travel as one.
/// Afterwards a patch holds complete sums on all nodes that its points touch.

#include <span>

#include "cairn/body/patch.hpp"
#include "cairn/parallel/communicator.hpp"
#include "cairn/parallel/distribution.hpp"

namespace cairn {

/// A nodal array to be summed: `used` of every `width` numbers.
template <int Dim>
struct NodeQuantity {
  AlignedDoubles NodeBox<Dim>::*values;
  int width, used;
};

/// An exchange: `begin`, `put` for every patch, `start`, `add` for every patch whose neighbours are all of this rank,
/// while the messages travel, `receive`, `add` for the rest. `add` comes after the `begin` of the next exchange, if at
/// all, and before the same patch's next `put`. Patches are named by their position among the rank's.
template <int Dim>
class NodeExchange {
 public:
  /// \param table    of all patches
  /// \param patches  of this rank; none may come or go
  NodeExchange(NeighbourExchange& messages, const PatchTable<Dim>& table, const std::vector<Patch<Dim>>& patches);

  /// True where a neighbour of the p-th patch lives on another rank.
  bool beside_others(std::size_t p) const;
  /// True where the p-th patch got nothing in the last exchange.
  bool is_quiet(std::size_t p) const { return parts_[p].empty(); }

  /// For the sums, forces (and extras) of shared nodes, with the boxes they cover: `add` makes node boxes grow to hold
  /// what arrives, and ghost pieces come and go.
  void begin_sums(bool extras);
  /// The same with other quantities, of node boxes that are not needed any more: for what is not part of a step.
  void begin_with_boxes(std::vector<NodeQuantity<Dim>> quantities);
  /// For one more array (forces of a new stress, momenta projected again) over the same nodes, put in the same order.
  void begin(AlignedDoubles NodeBox<Dim>::*values);
  void put(Patch<Dim>& patch, std::size_t p);
  void start();
  void receive();
  void add(Patch<Dim>& patch, std::size_t p);

 private:
  /// What one patch got from one neighbour for one body.
  struct Part {
    int link, body;
    Box<Dim> box;  // in the receiver's frame
    int rank;
    std::size_t at, nodes_before;  // first number in the message of the sums; rows before it in the message
    std::size_t rows_at = 0;       // first number of its further rows in the message of the sums
    std::vector<int> further;      // where these are in the piece, once it has been added to
  };
  struct Sent {
    int body;
    Box<Dim> box;  // in the sender's frame
    int rank;
  };
  struct Content {
    std::vector<NodeQuantity<Dim>> quantities;
    bool with_boxes = false;  // it is that of the sums
  };

  void put_with_boxes(Patch<Dim>& patch, std::size_t p);
  void parse(int rank);
  std::vector<Part>& parts_of(PatchId patch);
  void renew_ghosts(Patch<Dim>& patch, std::vector<Part>& parts) const;
  void add_to_piece(Piece<Dim>& piece, int links_before, std::span<Part> parts) const;
  void add_part(NodeBox<Dim>& nodes, const Part& part) const;
  void receive_rows(NodeBox<Dim>& nodes, const Box<Dim>& box, std::span<Part> parts) const;
  void add_rows(NodeBox<Dim>& nodes, std::span<const Part> parts, std::size_t parts_before) const;

  NeighbourExchange& messages_;
  Content out_, in_;                      // of what is put, and of what is added
  std::vector<std::vector<Sent>> sent_;   // for each patch, in the order of packing
  std::vector<std::vector<Part>> parts_;  // for each patch, ordered by (body, link)
  std::vector<PatchId> ids_;              // of each patch, ascending
  std::vector<std::vector<int>> ranks_;   // for each patch, of its links; -1 where there is no such patch
};

}  // namespace cairn
