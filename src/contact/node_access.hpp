#pragma once
/// Vectors and sums at a piece's nodes, by their offset.

#include <algorithm>

#include "cairn/body/piece.hpp"

namespace cairn::contact {

template <int Dim>
using ConstNode = Eigen::Map<const Vec<Dim>>;
template <int Dim>
using MutableNode = Eigen::Map<Vec<Dim>>;

template <int Dim>
const double* sums_at(const Piece<Dim>& piece, int node) {
  return piece.nodes.sums.data() + static_cast<std::size_t>(node) * NodeSums<Dim>::width;
}
/// The sums of all fields of a body at a node.
template <int Dim>
std::array<double, NodeSums<Dim>::width> whole_sums(const Piece<Dim>& piece, const Index<Dim>& place) {
  std::array<double, NodeSums<Dim>::width> sums;
  std::copy_n(sums_at(piece, piece.nodes.box.offset(place)), sums.size(), sums.begin());
  const auto [first, last] = piece.nodes.further.at(place);
  for (int k = first; k < last; ++k)
    for (std::size_t c = 0; c < sums.size(); ++c) sums[c] += sums_at(piece, piece.nodes.row_of(k))[c];
  return sums;
}
template <int Dim>
MutableNode<Dim> momentum_of(Piece<Dim>& piece, int node) {
  return MutableNode<Dim>(piece.nodes.sums.data() + static_cast<std::size_t>(node) * NodeSums<Dim>::width +
                          NodeSums<Dim>::momentum);
}
template <int Dim>
MutableNode<Dim> vector_of(AlignedDoubles& vectors, int node) {
  return MutableNode<Dim>(vectors.data() + static_cast<std::size_t>(node) * vector_width);
}
template <int Dim>
ConstNode<Dim> vector_of(const AlignedDoubles& vectors, int node) {
  return ConstNode<Dim>(vectors.data() + static_cast<std::size_t>(node) * vector_width);
}

/// The force on all fields of a body at the node with an offset in the box.
template <int Dim>
Vec<Dim> whole_force(const Piece<Dim>& piece, int node) {
  Vec<Dim> force = vector_of<Dim>(piece.nodes.force, node);
  if (piece.nodes.further.rows.empty()) return force;
  const auto [first, last] = piece.nodes.further.at(piece.nodes.box.place(node));
  for (int k = first; k < last; ++k) force += vector_of<Dim>(piece.nodes.force, piece.nodes.row_of(k));
  return force;
}

}  // namespace cairn::contact
