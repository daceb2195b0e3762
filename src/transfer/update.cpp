#include "kernels.hpp"

namespace cairn {
namespace {

using namespace kernels;

/// A node's motion, one row.
template <int Dim>
using MotionRow = std::conditional_t<Dim == 2, Lanes4, Lanes>;

template <int Dim>
MotionRow<Dim> load_motion(const double* motion, int node) {
  if constexpr (Dim == 2) return load4(motion + node * NodeMotion<Dim>::width);
  if constexpr (Dim == 3) return load(motion + node * NodeMotion<Dim>::width);
}

/// w_p += dt sum N arm x a / sum N arm^2, the transpose of how spin gives momentum to the nodes: energy and angular
/// momentum go to the points as the nodes have them. `moment[d]` is sum N arm_d (acceleration, velocity); of the rest,
/// 1 - `keep`, it takes the grid's spin. Returns the energy that this takes, per half the point's mass.
template <int Dim, class Shape>
double turn_point(Points<Dim>& points, int p, const Stencil<Dim, Shape>& stencil, int lane,
                  const MotionRow<Dim> (&moment)[Dim], double dt, double keep) {
  using M = NodeMotion<Dim>;
  double taken = 0;
  for_spins<Dim>([&](int s, int i, int j) {
    const double inertia = stencil.spread[i][lane] + stencil.spread[j][lane];
    if (!(inertia > 0)) return;  // on a node of linear shapes: it gives no momentum either
    const auto curl = [&](int first) { return (moment[i][first + j] - moment[j][first + i]) / inertia; };
    double& w = points.column(PointColumns<Dim>::spin + s)[p];
    const double turned = w + dt * curl(M::acceleration);
    w = keep * turned + (1.0 - keep) * curl(M::velocity);
    taken += inertia * (turned * turned - w * w);
  });
  return taken;
}

/// v_p += dt sum N a, blended with sum N v; and spin. Returns the energy [J] that blending and relaxation take.
template <int Dim, class Shape>
double gather_velocity(Piece<Dim>& piece, int first, int count, const Stencil<Dim, Shape>& stencil, double density,
                       double dt, const TransferSettings<Dim>& settings) {
  using M = NodeMotion<Dim>;
  double total = 0;
  const double* motion = piece.nodes.motion.data();
  for (int lane = 0; lane < count; ++lane) {
    double taken = 0;
    MotionRow<Dim> sum{};
    if constexpr (Stencil<Dim, Shape>::spinning) {
      MotionRow<Dim> moment[Dim] = {};
      stencil.for_nodes(lane, [&](int node, double w, const double(&)[Dim], const double(&arm)[Dim]) {
        const auto row = load_motion<Dim>(motion, node) * w;
        sum += row;
        for (int d = 0; d < Dim; ++d) moment[d] += row * arm[d];
      });
      double squared = 0;  // of the cells that the point moves in this step
      for (int d = 0; d < Dim; ++d) squared += std::pow(dt * sum[M::velocity + d] * stencil.inverse_spacing[d], 2);
      const double relaxed = std::min(1.0, settings.spin_relaxation * std::sqrt(squared));
      taken = turn_point(piece.points, first + lane, stencil, lane, moment, dt, settings.flip * (1.0 - relaxed));
    } else {
      stencil.for_nodes(lane,
                        [&](int node, double w, const double(&)[Dim]) { sum += load_motion<Dim>(motion, node) * w; });
    }
    for (int d = 0; d < Dim; ++d) {
      double& v = piece.points.column(PointColumns<Dim>::velocity + d)[first + lane];
      v += dt * sum[M::acceleration + d];
      if (settings.flip == 1.0) continue;
      const double updated = v;
      v = settings.flip * updated + (1.0 - settings.flip) * sum[M::velocity + d];
      taken += updated * updated - v * v;
    }
    total += 0.5 * density * piece.points.column(PointColumns<Dim>::volume)[first + lane] * taken;
  }
  return total;
}

template <int Dim, class Shape>
void scatter_momentum(const Points<Dim>& points, int first, int count, const Stencil<Dim, Shape>& stencil,
                      double density, double* momentum) {
  for (int lane = 0; lane < count; ++lane) {
    const double mass = density * points.column(PointColumns<Dim>::volume)[first + lane];
    scatter_row<0>(points, first + lane, stencil, lane, mass, Lanes4{},
                   [&](int node, Lanes4 row, const double(&)[Dim]) {
                     double* at = momentum + node * vector_width;
                     store4(at, load4(at) + row);
                   });
  }
}

/// x_p += dt sum N v; returns the largest squared speed, infinite where one is not finite.
template <int Dim, class Shape>
double move(Points<Dim>& points, int first, int count, const Stencil<Dim, Shape>& stencil, const double* motion,
            double dt, double fastest) {
  using C = PointColumns<Dim>;
  using M = NodeMotion<Dim>;
  constexpr double largest_number = std::numeric_limits<double>::max();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (int lane = 0; lane < count; ++lane) {
    MotionRow<Dim> sum{};
    stencil.for_nodes(lane,
                      [&](int node, double w, const double(&)[Dim]) { sum += load_motion<Dim>(motion, node) * w; });
    double squared = 0;
    for (int d = 0; d < Dim; ++d) {
      points.column(d)[first + lane] += dt * sum[M::velocity + d];
      const double v = points.column(C::velocity + d)[first + lane];
      squared += v * v;
    }
    fastest = squared <= largest_number ? std::max(fastest, squared) : infinity;
  }
  return fastest;
}

/// Calls f(first, count, stencil) for every eight points of the piece on its whole node box.
template <int Dim, class F>
void for_piece(const Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings, F&& f) {
  with_shape(settings, [&](const auto& shape) { for_chunks(piece.points, lattice, piece.nodes.box, shape, f); });
}

/// As for_piece, with spin where points carry it.
template <int Dim, class F>
void for_moving_piece(const Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                      F&& f) {
  with_moving_shape(settings, [&](const auto& shape) { for_chunks(piece.points, lattice, piece.nodes.box, shape, f); });
}

}  // namespace

template <int Dim>
void update_stress_and_move(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                            const Law& law, double density, double strain_dt, double dt, SpeedLimits& speeds) {
  double fastest_wave = speeds.wave * speeds.wave, fastest_point = speeds.point * speeds.point;
  std::visit(
      [&](const auto& any) {
        const auto& concrete = law_of_step(any, strain_dt);
        for_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
          const auto A = gather_strain(stencil, count, piece.nodes.velocity.data(), strain_dt);
          fastest_wave = apply_law(piece.points, first, count, concrete, A, 1.0 / density, fastest_wave);
          fastest_point = move(piece.points, first, count, stencil, piece.nodes.motion.data(), dt, fastest_point);
        });
      },
      law);
  speeds = {std::sqrt(fastest_wave), std::sqrt(fastest_point)};
}

template <int Dim>
void update_stress_and_force(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                             const Law& law, double density, double dt, SpeedLimits& speeds) {
  double fastest = speeds.wave * speeds.wave;
  std::fill(piece.nodes.force.begin(), piece.nodes.force.end(), 0.0);
  std::visit(
      [&](const auto& any) {
        const auto& concrete = law_of_step(any, dt);
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
double accelerate(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings, double density,
                  double dt) {
  double taken = 0;
  for_moving_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
    taken += gather_velocity(piece, first, count, stencil, density, dt, settings);
  });
  return taken;
}

template <int Dim>
double accelerate_and_move(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                           double density, double dt, SpeedLimits& speeds) {
  double taken = 0, fastest = speeds.point * speeds.point;
  for_moving_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
    taken += gather_velocity(piece, first, count, stencil, density, dt, settings);
    fastest = move(piece.points, first, count, stencil, piece.nodes.motion.data(), dt, fastest);
  });
  speeds.point = std::sqrt(fastest);
  return taken;
}

template <int Dim>
void project_momentum(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                      double density) {
  piece.nodes.velocity.assign(piece.nodes.box.size() * vector_width, 0.0);
  for_moving_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
    scatter_momentum(piece.points, first, count, stencil, density, piece.nodes.velocity.data());
  });
}

template <int Dim>
double accelerate_and_project(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                              double density, double dt) {
  double taken = 0;
  piece.nodes.velocity.assign(piece.nodes.box.size() * vector_width, 0.0);
  for_moving_piece(piece, lattice, settings, [&](int first, int count, const auto& stencil) {
    taken += gather_velocity(piece, first, count, stencil, density, dt, settings);
    scatter_momentum(piece.points, first, count, stencil, density, piece.nodes.velocity.data());
  });
  return taken;
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
void centre_motion(Piece<Dim>& piece) {
  using M = NodeMotion<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  for (std::size_t node = 0; node < nodes.box.size(); ++node)
    for (int d = 0; d < Dim; ++d) {
      double& v = nodes.motion[node * M::width + M::velocity + d];
      v = 0.5 * (v + nodes.velocity[node * vector_width + d]);
    }
}

template <int Dim>
std::vector<std::array<double, spin_size<Dim>>> spin_inertia(const Piece<Dim>& piece, const Lattice<Dim>& lattice,
                                                             const TransferSettings<Dim>& settings) {
  std::vector<std::array<double, spin_size<Dim>>> inertia(piece.points.size());
  for_moving_piece(piece, lattice, settings,
                   [&]<class Shape>(int first, int count, const Stencil<Dim, Shape>& stencil) {
                     if constexpr (Stencil<Dim, Shape>::spinning)
                       for (int lane = 0; lane < count; ++lane)
                         for_spins<Dim>([&](int s, int i, int j) {
                           inertia[first + lane][s] = stencil.spread[i][lane] + stencil.spread[j][lane];
                         });
                   });
  return inertia;
}

template <int Dim>
void velocity_from_motion(Piece<Dim>& piece) {
  using M = NodeMotion<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  nodes.velocity.assign(nodes.box.size() * vector_width, 0.0);
  for (std::size_t node = 0; node < nodes.box.size(); ++node)
    std::copy_n(nodes.motion.data() + node * M::width + M::velocity, Dim, nodes.velocity.data() + node * vector_width);
}

#define CAIRN_INSTANTIATE(Dim)                                                                                        \
  template void update_stress_and_move(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, const Law&,    \
                                       double, double, double, SpeedLimits&);                                         \
  template void update_stress_and_force(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, const Law&,   \
                                        double, double, SpeedLimits&);                                                \
  template double accelerate(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double, double);         \
  template void project_momentum(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double);             \
  template double accelerate_and_project(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double,      \
                                         double);                                                                     \
  template double accelerate_and_move(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double, double, \
                                      SpeedLimits&);                                                                  \
  template void integrate(Piece<Dim>&, double);                                                                       \
  template void velocity_from_sums(Piece<Dim>&);                                                                      \
  template void velocity_from_momentum(Piece<Dim>&);                                                                  \
  template void velocity_from_motion(Piece<Dim>&);                                                                    \
  template void centre_motion(Piece<Dim>&);                                                                           \
  template std::vector<std::array<double, spin_size<Dim>>> spin_inertia(const Piece<Dim>&, const Lattice<Dim>&,       \
                                                                        const TransferSettings<Dim>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
