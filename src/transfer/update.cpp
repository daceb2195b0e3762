#include "kernels.hpp"

namespace cairn {
namespace {

using namespace kernels;

/// sum N (acceleration, velocity) for one point.
template <int Dim, class Shape>
auto gather_motion(const Stencil<Dim, Shape>& stencil, int lane, const double* motion) {
  using M = NodeMotion<Dim>;
  if constexpr (Dim == 2) {
    Lanes4 sum{};
    stencil.for_nodes(lane,
                      [&](int node, double w, const double(&)[Dim]) { sum += load4(motion + node * M::width) * w; });
    return sum;
  } else {
    Lanes sum{};
    stencil.for_nodes(lane,
                      [&](int node, double w, const double(&)[Dim]) { sum += load(motion + node * M::width) * w; });
    return sum;
  }
}

/// v_p += dt sum N a, blended with sum N v.
template <int Dim, class Shape>
void gather_velocity(Piece<Dim>& piece, int first, int count, const Stencil<Dim, Shape>& stencil, double dt,
                     double flip) {
  using M = NodeMotion<Dim>;
  for (int lane = 0; lane < count; ++lane) {
    const auto sum = gather_motion(stencil, lane, piece.nodes.motion.data());
    for (int d = 0; d < Dim; ++d) {
      double& v = piece.points.column(PointColumns<Dim>::velocity + d)[first + lane];
      v += dt * sum[M::acceleration + d];
      if (flip != 1.0) v = flip * v + (1.0 - flip) * sum[M::velocity + d];
    }
  }
}

template <int Dim, class Shape>
void scatter_momentum(const Points<Dim>& points, int first, int count, const Stencil<Dim, Shape>& stencil,
                      double density, double* momentum) {
  using C = PointColumns<Dim>;
  for (int lane = 0; lane < count; ++lane) {
    Lanes4 p{};
    const double mass = density * points.column(C::volume)[first + lane];
    for (int d = 0; d < Dim; ++d) p[d] = mass * points.column(C::velocity + d)[first + lane];
    stencil.for_nodes(lane, [&](int node, double w, const double(&)[Dim]) {
      double* at = momentum + node * vector_width;
      store4(at, load4(at) + p * w);
    });
  }
}

/// Calls f(first, count, stencil) for every eight points of the piece on its whole node box.
template <int Dim, class F>
void for_piece(const Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings, F&& f) {
  with_shape(settings, [&](const auto& shape) { for_chunks(piece.points, lattice, piece.nodes.box, shape, f); });
}

}  // namespace

template <int Dim>
void update_stress(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                   const Law& law, double density, double dt, SpeedLimits& speeds) {
  double fastest = speeds.wave * speeds.wave;
  std::visit(
      [&](const auto& concrete) {
        for_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
          const auto A = gather_strain(stencil, count, piece.nodes.velocity.data(), dt);
          fastest = apply_law(piece.points, first, count, concrete, A, 1.0 / density, fastest);
        });
      },
      law);
  speeds.wave = std::sqrt(fastest);
}

template <int Dim>
void update_stress_and_force(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                             const Law& law, double density, double dt, SpeedLimits& speeds) {
  double fastest = speeds.wave * speeds.wave;
  std::fill(piece.nodes.force.begin(), piece.nodes.force.end(), 0.0);
  std::visit(
      [&](const auto& concrete) {
        for_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
          const auto A = gather_strain(stencil, count, piece.nodes.velocity.data(), dt);
          fastest = apply_law(piece.points, first, count, concrete, A, 1.0 / density, fastest);
          const PointForce<Dim> force(piece.points, first, density, settings.gravity);
          for (int lane = 0; lane < count; ++lane) force.scatter(stencil, lane, piece.nodes.force.data());
        });
      },
      law);
  speeds.wave = std::sqrt(fastest);
}

template <int Dim>
void accelerate(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings, double dt) {
  for_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
    gather_velocity(piece, first, count, stencil, dt, settings.flip);
  });
}

template <int Dim>
void project_momentum(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                      double density) {
  piece.nodes.velocity.assign(piece.nodes.box.size() * vector_width, 0.0);
  for_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
    scatter_momentum(piece.points, first, count, stencil, density, piece.nodes.velocity.data());
  });
}

template <int Dim>
void accelerate_and_project(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                            double density, double dt) {
  piece.nodes.velocity.assign(piece.nodes.box.size() * vector_width, 0.0);
  for_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
    gather_velocity(piece, first, count, stencil, dt, settings.flip);
    scatter_momentum(piece.points, first, count, stencil, density, piece.nodes.velocity.data());
  });
}

template <int Dim>
void move(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings, double dt,
          SpeedLimits& speeds) {
  using C = PointColumns<Dim>;
  using M = NodeMotion<Dim>;
  Points<Dim>& points = piece.points;
  double fastest = speeds.point * speeds.point;
  for_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
    for (int lane = 0; lane < count; ++lane) {
      const auto sum = gather_motion(stencil, lane, piece.nodes.motion.data());
      double squared = 0;
      for (int d = 0; d < Dim; ++d) {
        points.column(d)[first + lane] += dt * sum[M::velocity + d];
        const double v = points.column(C::velocity + d)[first + lane];
        squared += v * v;
      }
      fastest = std::max(fastest, squared);
    }
  });
  speeds.point = std::sqrt(fastest);
}

template <int Dim>
void integrate(Piece<Dim>& piece, double dt) {
  using N = NodeSums<Dim>;
  using M = NodeMotion<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  resize_exactly(nodes.motion, nodes.box.size() * M::width);
  for (std::size_t node = 0; node < nodes.box.size(); ++node) {
    const double* sums = nodes.sums.data() + node * N::width;
    const double* force = nodes.force.data() + node * vector_width;
    double* motion = nodes.motion.data() + node * M::width;
    const double inverse = sums[N::mass] > 0 ? 1.0 / sums[N::mass] : 0.0;
    for (int d = 0; d < Dim; ++d) {
      motion[M::acceleration + d] = force[d] * inverse;
      motion[M::velocity + d] = (sums[N::momentum + d] + dt * force[d]) * inverse;
    }
    for (int d = M::used; d < M::width; ++d) motion[d] = 0;
  }
}

template <int Dim>
void velocity_from_sums(Piece<Dim>& piece) {
  using N = NodeSums<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  resize_exactly(nodes.velocity, nodes.box.size() * vector_width);
  for (std::size_t node = 0; node < nodes.box.size(); ++node) {
    const double* sums = nodes.sums.data() + node * N::width;
    double* velocity = nodes.velocity.data() + node * vector_width;
    const double inverse = sums[N::mass] > 0 ? 1.0 / sums[N::mass] : 0.0;
    for (int d = 0; d < vector_width; ++d) velocity[d] = d < Dim ? sums[N::momentum + d] * inverse : 0.0;
  }
}

template <int Dim>
void velocity_from_momentum(Piece<Dim>& piece) {
  using N = NodeSums<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  for (std::size_t node = 0; node < nodes.box.size(); ++node) {
    const double mass = nodes.sums[node * N::width + N::mass];
    const double inverse = mass > 0 ? 1.0 / mass : 0.0;
    for (int d = 0; d < Dim; ++d) nodes.velocity[node * vector_width + d] *= inverse;
  }
}

template <int Dim>
void velocity_from_motion(Piece<Dim>& piece) {
  using M = NodeMotion<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  nodes.velocity.assign(nodes.box.size() * vector_width, 0.0);
  for (std::size_t node = 0; node < nodes.box.size(); ++node)
    std::copy_n(nodes.motion.data() + node * M::width + M::velocity, Dim, nodes.velocity.data() + node * vector_width);
}

#define CAIRN_INSTANTIATE(Dim)                                                                                      \
  template void update_stress(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, const Law&, double,   \
                              double, SpeedLimits&);                                                                \
  template void update_stress_and_force(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, const Law&, \
                                        double, double, SpeedLimits&);                                              \
  template void accelerate(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double);                 \
  template void project_momentum(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double);           \
  template void accelerate_and_project(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double,      \
                                       double);                                                                     \
  template void move(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double, SpeedLimits&);         \
  template void integrate(Piece<Dim>&, double);                                                                     \
  template void velocity_from_sums(Piece<Dim>&);                                                                    \
  template void velocity_from_momentum(Piece<Dim>&);                                                                \
  template void velocity_from_motion(Piece<Dim>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
