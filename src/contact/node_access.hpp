#pragma once
/// Vectors and sums at a piece's nodes, by their offset.

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

}  // namespace cairn::contact
