#pragma once
/// Piece: the part of one body that lies in one patch. It owns its points and a small dense box of nodes.

#include "cairn/body/further_rows.hpp"
#include "cairn/body/points.hpp"
#include "cairn/grid/box.hpp"

namespace cairn {

/// What a body is, the same on every rank: a few bytes for each body.
struct Body {
  std::int32_t material = 0;
  bool rigid = false;                    // moves as prescribed, infinitely heavy in contact
  Vec3 velocity = Vec3::Zero();          // of a rigid body, now [m/s]
  Vec3 angular_velocity = Vec3::Zero();  // of a rigid body, now [rad/s] about its centre
  Vec3 centre = Vec3::Zero();            // at the start [m]
  Vec3 change = Vec3::Zero();            // of a rigid body's velocity in this step, where that is given [m/s]
  std::int32_t tool = -1;                // that a rigid body belongs to (body/tool.hpp)
};

/// Sums over the points of a body at a node, eight doubles a node:
/// mass [kg], momentum [kg m/s], volume [m^Dim], outward gradient (volume or mass times grad N).
template <int Dim>
struct NodeSums {
  static constexpr int mass = 0, momentum = 1, volume = 1 + Dim, gradient = 2 + Dim;
  static constexpr int used = 2 + 2 * Dim, width = 8;
};
/// Sums that only some releases need: volume-weighted stress (xx yy xy | xx yy zz xy yz xz) and position relative to
/// the node.
template <int Dim>
struct NodeExtras {
  static constexpr int stress = 0, position = Dim == 2 ? 3 : 6;
  static constexpr int used = position + Dim, width = Dim == 2 ? 8 : 16;
};
/// What a smooth field of stress is made of, in the place of the sums (docs/results.md): volume [m^Dim], and
/// volume-weighted stress (xx yy zz xy | xx yy zz xy yz xz).
template <int Dim>
struct NodeStress {
  static constexpr int volume = 0, stress = 1;
  static constexpr int used = 1 + symmetric_size<Dim>, width = NodeSums<Dim>::width;
};
/// What points gather to move: acceleration, then velocity.
template <int Dim>
struct NodeMotion {
  static constexpr int acceleration = 0, velocity = Dim;
  static constexpr int used = 2 * Dim, width = Dim == 2 ? 4 : 8;
};
inline constexpr int vector_width = 4;  // a vector at a node, padded

/// Nodal quantities of a body: of its velocity field over a box of nodes, and of what further fields it has where
/// cracks cut it. Arrays hold `storage` rows: the box, the further rows, and a scratch copy of some.
template <int Dim>
struct NodeBox {
  Box<Dim> box;             // all nodes with data: own and received
  Box<Dim> own;             // nodes that the piece's own points touch
  AlignedDoubles sums;      // NodeSums
  AlignedDoubles force;     // internal + external force [N], vector_width
  AlignedDoubles velocity;  // velocity for strains [m/s] (or momentum, while it is projected again), vector_width
  AlignedDoubles motion;    // NodeMotion
  AlignedDoubles extras;    // NodeExtras, empty where not needed
  FurtherRows<Dim> further;

  /// Rows that hold something.
  std::size_t rows() const { return box.size() + further.rows.size(); }
  std::size_t storage() const { return rows() + further.scratch; }
  /// The row of a further one, by its position.
  int row_of(int further_row) const { return static_cast<int>(box.size()) + further_row; }

  std::size_t memory() const {
    return further.memory() +
           (sums.capacity() + force.capacity() + velocity.capacity() + motion.capacity() + extras.capacity()) *
               sizeof(double);
  }
};

/// A piece without points is a ghost: a body known only to neighbouring patches.
template <int Dim>
struct Piece {
  int body;
  Points<Dim> points;
  NodeBox<Dim> nodes;
  bool projected = false;         // the nodes have the sums of the points as they are
  Vec3 net_force = Vec3::Zero();  // in the last step at the nodes that the patch answers for, where it is asked for [N]

  Piece(int body_, int states) : body(body_), points(states) {}
};

}  // namespace cairn
