#pragma once
/// Sums of nodal quantities over patches.
///
/// Each patch sends, for every neighbouring patch and every piece that touches nodes both share, the box of shared
/// nodes and the piece's own contributions there; it receives the like. A body that only the neighbour knows arrives as
/// a ghost piece. Contributions are added in ascending order of (patch, the contributor's own node position), the
/// patch's own included, so that every patch finds the same bits, wherever patches live. All messages between two ranks
/// travel as one. Afterwards a patch holds complete sums on all nodes that its points touch.

#include "cairn/body/patch.hpp"
#include "cairn/parallel/communicator.hpp"

namespace cairn {

/// A nodal array to be summed: `used` of every `width` numbers.
template <int Dim>
struct NodeQuantity {
  AlignedDoubles NodeBox<Dim>::*values;
  int width, used;
};

template <int Dim>
class NodeExchange {
 public:
  /// \param owner  the rank of every patch; must outlive this object unchanged
  NodeExchange(NeighbourExchange& messages, const std::vector<int>& owner) : messages_(messages), owner_(owner) {}

  /// True where the piece touches nodes that a neighbour shares: such pieces must be projected before `start_sums`.
  static bool shares_nodes(const Patch<Dim>& patch, const Piece<Dim>& piece);

  /// Sends the sums, forces (and extras) of shared nodes, with the boxes they cover.
  void start_sums(std::vector<Patch<Dim>>& patches, bool extras);
  /// Receives and adds them; node boxes grow to hold what arrives, ghost pieces come and go.
  void finish_sums(std::vector<Patch<Dim>>& patches);

  /// Sums one more array (forces of a new stress, momenta projected again) over the same nodes.
  void sum(std::vector<Patch<Dim>>& patches, AlignedDoubles NodeBox<Dim>::*values);

 private:
  /// What one patch got from one neighbour for one body.
  struct Part {
    int link, body;
    Box<Dim> box;  // in the receiver's frame
    int rank;
    std::size_t at;  // first number in the message
  };
  struct Sent {
    int patch, piece_body;  // position among the patches, body
    Box<Dim> box;           // in the sender's frame
    int rank;
  };
  using Quantities = std::vector<NodeQuantity<Dim>>;

  void parse(int rank);
  void add_parts(Patch<Dim>& patch, std::vector<Part>& parts);
  void add_to_piece(Piece<Dim>& piece, int links_before, const Part* begin, const Part* end,
                    const Quantities& quantities, bool grow);
  void add_part(NodeBox<Dim>& nodes, const Part& part, const Quantities& quantities) const;

  NeighbourExchange& messages_;
  const std::vector<int>& owner_;
  Quantities quantities_;                 // of start_sums
  std::vector<Sent> sent_;                // in the order of packing
  std::vector<std::vector<Part>> parts_;  // for each patch, ordered by (body, link)
  std::vector<int> position_;             // of each local patch by id, else -1
};

}  // namespace cairn
