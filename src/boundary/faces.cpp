#include "cairn/boundary/faces.hpp"

namespace cairn {
namespace {

/// Calls f(d, side, plane) for every face of the wanted type on which the patch lies; plane is the face's node.
template <int Dim, class F>
void for_faces(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces, FaceType type,
               F&& f) {
  for (int d = 0; d < Dim; ++d)
    for (int side = 0; side < 2; ++side) {
      const int plane = side == 0 ? 0 : lattice.cells()[d];
      const bool here = side == 0 ? patch.cells.lower[d] == 0 : patch.cells.upper[d] == plane;
      if (here && faces[2 * d + side].type == type) f(d, side, plane);
    }
}

/// The nodes of `box` on the face and beyond.
template <int Dim>
Box<Dim> at_face(Box<Dim> box, int d, int side, int plane) {
  if (side == 0)
    box.upper[d] = std::min(box.upper[d], plane + 1);
  else
    box.lower[d] = std::max(box.lower[d], plane);
  return box;
}

/// The further rows' part of a mirror: the image of a crack that meets the plane at a right angle is its own.
template <int Dim, class Row, class Double, class Exchange>
void mirror_further(const NodeBox<Dim>& nodes, int d, int plane, int inwards, Row&& row, Double&& double_on_plane,
                    Exchange&& exchange) {
  const FurtherRows<Dim>& further = nodes.further;
  for (std::size_t k = 0; k < further.rows.size(); ++k) {
    const FurtherRow<Dim>& outside = further.rows[k];
    if (outside.place[d] == plane) double_on_plane(row(nodes.row_of(static_cast<int>(k))));
    if (outside.place[d] != plane - inwards) continue;
    Index<Dim> place = outside.place;
    place[d] += 2 * inwards;
    const int inside = further.find(place, outside.sides);
    if (inside >= 0) exchange(row(nodes.row_of(inside)), row(nodes.row_of(static_cast<int>(k))));
  }
}

/// Which of a node's numbers change sign in a mirror across direction d.
template <int Dim>
using Parity = void (*)(int d, std::vector<bool>& odd);

template <int Dim>
void mirror(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
            AlignedDoubles NodeBox<Dim>::*values, int width, Parity<Dim> parity) {
  for_faces<Dim>(patch, lattice, faces, FaceType::symmetry, [&](int d, int side, int plane) {
    std::vector<bool> odd(width, false);
    parity(d, odd);
    const int inwards = side == 0 ? 1 : -1;
    for (auto& piece : patch.pieces) {
      auto& array = piece.nodes.*values;
      if (array.empty()) continue;
      const Box<Dim>& box = piece.nodes.box;
      const auto double_on_plane = [&](double* here) {
        for (int c = 0; c < width; ++c) here[c] = odd[c] ? 0.0 : 2 * here[c];
      };
      const auto exchange = [&](double* in, double* out) {
        for (int c = 0; c < width; ++c) in[c] += odd[c] ? -out[c] : out[c], out[c] = odd[c] ? -in[c] : in[c];
      };
      Box<Dim> on_plane = box;
      on_plane.lower[d] = plane, on_plane.upper[d] = plane + 1;
      for_each(intersection(on_plane, box), [&](const Index<Dim>& i) {
        double_on_plane(array.data() + static_cast<std::size_t>(box.offset(i)) * width);
        Index<Dim> inside = i, outside = i;
        inside[d] += inwards, outside[d] -= inwards;
        if (!box.contains(outside)) return;
        double* out = array.data() + static_cast<std::size_t>(box.offset(outside)) * width;
        if (!box.contains(inside)) return;  // nothing inside: what lies beyond is its own image's image
        exchange(array.data() + static_cast<std::size_t>(box.offset(inside)) * width, out);
      });
      mirror_further<Dim>(
          piece.nodes, d, plane, inwards, [&](int row) { return array.data() + row * width; }, double_on_plane,
          exchange);
    }
  });
}

/// Shear across a plane with the normal along d is odd; the first shear (xy | xy yz xz) is component `first`.
template <int Dim>
void mark_shear(int d, int first, std::vector<bool>& odd) {
  if (Dim == 2)
    odd[first] = true;
  else
    for (int shear = 0; shear < 3; ++shear) odd[first + shear] = d == shear || d == (shear + 1) % 3;
}

template <int Dim>
Eigen::Map<Vec<Dim>> momentum_of(Piece<Dim>& piece, int node) {
  return Eigen::Map<Vec<Dim>>(piece.nodes.sums.data() + static_cast<std::size_t>(node) * NodeSums<Dim>::width +
                              NodeSums<Dim>::momentum);
}
template <int Dim>
Eigen::Map<Vec<Dim>> vector_of(AlignedDoubles& vectors, int node) {
  return Eigen::Map<Vec<Dim>>(vectors.data() + static_cast<std::size_t>(node) * vector_width);
}

/// Calls f(piece, node position, node offset, number of the face) for every node with mass of a deformable piece on
/// fixed faces.
template <int Dim, class F>
void for_fixed_nodes(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                     const std::vector<Body>& bodies, F&& f) {
  for_faces<Dim>(patch, lattice, faces, FaceType::fixed, [&](int d, int side, int plane) {
    for (auto& piece : patch.pieces) {
      if (bodies[piece.body].rigid) continue;
      const Box<Dim>& box = piece.nodes.box;
      const auto visit = [&](const Index<Dim>& i, int node) {
        if (piece.nodes.sums[static_cast<std::size_t>(node) * NodeSums<Dim>::width] > 0)
          f(piece, i, node, 2 * d + side);
      };
      const Box<Dim> there = at_face(box, d, side, plane);
      for_each(there, [&](const Index<Dim>& i) { visit(i, box.offset(i)); });
      for (std::size_t k = 0; k < piece.nodes.further.rows.size(); ++k)
        if (const auto& place = piece.nodes.further.rows[k].place; there.contains(place))
          visit(place, piece.nodes.row_of(static_cast<int>(k)));
    }
  });
}

}  // namespace

template <int Dim>
void mirror_sums(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces) {
  mirror<Dim>(patch, lattice, faces, &NodeBox<Dim>::sums, NodeSums<Dim>::width, [](int d, std::vector<bool>& odd) {
    odd[NodeSums<Dim>::momentum + d] = odd[NodeSums<Dim>::gradient + d] = true;
  });
  mirror<Dim>(patch, lattice, faces, &NodeBox<Dim>::extras, NodeExtras<Dim>::width, [](int d, std::vector<bool>& odd) {
    odd[NodeExtras<Dim>::position + d] = true;
    mark_shear<Dim>(d, NodeExtras<Dim>::stress + (Dim == 2 ? 2 : 3), odd);
  });
  mirror_vectors(patch, lattice, faces, &NodeBox<Dim>::force);
}

template <int Dim>
void mirror_vectors(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                    AlignedDoubles NodeBox<Dim>::*vectors) {
  mirror<Dim>(patch, lattice, faces, vectors, vector_width, [](int d, std::vector<bool>& odd) { odd[d] = true; });
}

template <int Dim>
void mirror_stress(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces) {
  mirror<Dim>(patch, lattice, faces, &NodeBox<Dim>::sums, NodeStress<Dim>::width,
              [](int d, std::vector<bool>& odd) { mark_shear<Dim>(d, NodeStress<Dim>::stress + 3, odd); });
}

template <int Dim>
void constrain_velocity(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                        const std::vector<Body>& bodies, bool close_ledger) {
  for_fixed_nodes<Dim>(
      patch, lattice, faces, bodies, [&](Piece<Dim>& piece, const Index<Dim>& place, int node, int face) {
        auto velocity = vector_of<Dim>(piece.nodes.velocity, node);
        if (close_ledger) {
          const double mass = piece.nodes.sums[static_cast<std::size_t>(node) * NodeSums<Dim>::width];
          const Vec<Dim> momentum = momentum_of(piece, node), given = faces[face].velocity;
          patch.ledger.contact_dissipation += node_share<Dim>(patch.id, place, lattice, faces) *
                                              (mass * given - momentum).dot(given - 0.5 * (momentum / mass + velocity));
        }
        velocity = faces[face].velocity;
      });
}

template <int Dim>
void constrain_motion(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                      const std::vector<Body>& bodies, double dt, bool close_ledger, bool keep_tools) {
  using M = NodeMotion<Dim>;
  for_fixed_nodes<Dim>(patch, lattice, faces, bodies,
                       [&](Piece<Dim>& piece, const Index<Dim>& place, int node, int face) {
                         const double mass = piece.nodes.sums[static_cast<std::size_t>(node) * NodeSums<Dim>::width];
                         double* motion = piece.nodes.motion.data() + static_cast<std::size_t>(node) * M::width;
                         Eigen::Map<Vec<Dim>> velocity(motion + M::velocity), acceleration(motion + M::acceleration);
                         const Vec<Dim> before = momentum_of(piece, node) / mass, given = faces[face].velocity;
                         const double share = node_share<Dim>(patch.id, place, lattice, faces);
                         const Vec<Dim> impulse = share * mass * (given - velocity);
                         velocity = given;
                         acceleration = (given - before) / dt;
                         if (share == 0) return;
                         const double work = impulse.dot(given);
                         patch.ledger.boundary_work += work;
                         if (close_ledger)
                           patch.ledger.contact_dissipation += 0.5 * share * mass * (given - before).squaredNorm();
                         if (!keep_tools) return;
                         Vec3 x = Vec3::Zero(), on_face = Vec3::Zero();
                         for (int d = 0; d < Dim; ++d) x[d] = lattice.node_position(d, place[d]);
                         on_face.head<Dim>() = -impulse;
                         patch.tools[face].add(on_face, x, work);
                       });
}

#define CAIRN_INSTANTIATE(Dim)                                                                   \
  template void mirror_sums(Patch<Dim>&, const Lattice<Dim>&, const FaceConditions<Dim>&);       \
  template void mirror_vectors(Patch<Dim>&, const Lattice<Dim>&, const FaceConditions<Dim>&,     \
                               AlignedDoubles NodeBox<Dim>::*);                                  \
  template void mirror_stress(Patch<Dim>&, const Lattice<Dim>&, const FaceConditions<Dim>&);     \
  template void constrain_velocity(Patch<Dim>&, const Lattice<Dim>&, const FaceConditions<Dim>&, \
                                   const std::vector<Body>&, bool);                              \
  template void constrain_motion(Patch<Dim>&, const Lattice<Dim>&, const FaceConditions<Dim>&,   \
                                 const std::vector<Body>&, double, bool, bool);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
