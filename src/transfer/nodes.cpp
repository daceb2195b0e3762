// What is done at nodes alone: momentum and force become velocity and acceleration.

#include "kernels.hpp"

namespace cairn {

template <int Dim>
void integrate(Piece<Dim>& piece, double dt) {
  using N = NodeSums<Dim>;
  using M = NodeMotion<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  resize_exactly(nodes.motion, nodes.storage() * M::width);
  for (std::size_t node = 0; node < nodes.rows(); ++node) {
    const double* sums = nodes.sums.data() + node * N::width;
    const double* f = nodes.force.data() + node * vector_width;
    const double* p = sums + N::momentum;
    const double inverse = sums[N::mass] > 0 ? 1.0 / sums[N::mass] : 0.0;
    if constexpr (Dim == 2)
      store4(nodes.motion.data() + node * M::width, Lanes4{f[0], f[1], p[0] + dt * f[0], p[1] + dt * f[1]} * inverse);
    else
      store(nodes.motion.data() + node * M::width,
            Lanes{f[0], f[1], f[2], p[0] + dt * f[0], p[1] + dt * f[1], p[2] + dt * f[2], 0, 0} * inverse);
  }
}

template <int Dim>
void velocity_from_sums(Piece<Dim>& piece) {
  using N = NodeSums<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  resize_exactly(nodes.velocity, nodes.storage() * vector_width);
  for (std::size_t node = 0; node < nodes.rows(); ++node) {
    const double* sums = nodes.sums.data() + node * N::width;
    const double* p = sums + N::momentum;
    const double inverse = sums[N::mass] > 0 ? 1.0 / sums[N::mass] : 0.0;
    store4(nodes.velocity.data() + node * vector_width, Lanes4{p[0], p[1], Dim == 3 ? p[2] : 0, 0} * inverse);
  }
}

template <int Dim>
void velocity_from_momentum(Piece<Dim>& piece) {
  using N = NodeSums<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  for (std::size_t node = 0; node < nodes.rows(); ++node) {
    const double mass = nodes.sums[node * N::width + N::mass];
    const double inverse = mass > 0 ? 1.0 / mass : 0.0;
    for (int d = 0; d < Dim; ++d) nodes.velocity[node * vector_width + d] *= inverse;
  }
}

template <int Dim>
void centre_motion(Piece<Dim>& piece) {
  using M = NodeMotion<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  for (std::size_t node = 0; node < nodes.rows(); ++node)
    for (int d = 0; d < Dim; ++d) {
      double& v = nodes.motion[node * M::width + M::velocity + d];
      v = 0.5 * (v + nodes.velocity[node * vector_width + d]);
    }
}

template <int Dim>
void follow_projected(Piece<Dim>& piece) {
  using M = NodeMotion<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  for (std::size_t node = 0; node < nodes.rows(); ++node)
    std::copy_n(nodes.velocity.data() + node * vector_width, Dim, nodes.motion.data() + node * M::width + M::velocity);
}

template <int Dim>
void velocity_from_motion(Piece<Dim>& piece) {
  using M = NodeMotion<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  nodes.velocity.assign(nodes.storage() * vector_width, 0.0);
  for (std::size_t node = 0; node < nodes.rows(); ++node)
    std::copy_n(nodes.motion.data() + node * M::width + M::velocity, Dim, nodes.velocity.data() + node * vector_width);
}

#define CAIRN_INSTANTIATE(Dim)                       \
  template void integrate(Piece<Dim>&, double);      \
  template void velocity_from_sums(Piece<Dim>&);     \
  template void velocity_from_momentum(Piece<Dim>&); \
  template void centre_motion(Piece<Dim>&);          \
  template void follow_projected(Piece<Dim>&);       \
  template void velocity_from_motion(Piece<Dim>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
