#include "kernels.hpp"

namespace cairn {
namespace {

using namespace kernels;

/// A node's motion, one row.
template <int Dim>
using MotionRow = std::conditional_t<Dim == 2, Lanes4, Lanes>;

/// Sums over a point's nodes.
template <int Dim>
struct PointMotion {
  MotionRow<Dim> sum{};          // N (acceleration, velocity)
  MotionRow<Dim> moment[Dim]{};  // with spin: for each direction, N arm (acceleration, velocity)
};

template <int Dim, class Shape>
PointMotion<Dim> gather_motion(const Stencil<Dim, Shape>& stencil, int lane, const double* motion) {
  using S = Stencil<Dim, Shape>;
  PointMotion<Dim> m;
  if constexpr (!is_product<S>) {
    stencil.for_weights(lane, [&](int node, const NodeWeights<Dim>& at) {
      const auto given = load_row<MotionRow<Dim>>(motion, node) * at.value;
      m.sum += given;
      if constexpr (S::spinning)
        for (int d = 0; d < Dim; ++d) m.moment[d] += given * at.arm[d];
    });
  } else {
    const auto x = stencil.along_x(lane);
    stencil.for_rows(lane, [&](int node, const RowWeights<Dim>& row) {
      MotionRow<Dim> by_value{}, by_lever{};
      for (int i = 0; i < S::n; ++i) {
        const auto at = load_row<MotionRow<Dim>>(motion, node + i);
        by_value += at * x.value[i];
        if constexpr (S::spinning) by_lever += at * x.lever[i];
      }
      m.sum += by_value * row.value;
      if constexpr (S::spinning) {
        m.moment[0] += by_lever * row.value;
        for (int d = 1; d < Dim; ++d) m.moment[d] += by_value * (row.value * row.arm[d]);
      }
    });
  }
  return m;
}

/// w_p += dt sum N arm x a / sum N arm^2, the transpose of how spin gives momentum to the nodes: energy and angular
/// momentum go to the points as the nodes have them. `moment[d]` is sum N arm_d (acceleration, velocity); of the rest,
/// 1 - `keep`, it takes the grid's spin. Returns the energy that the nodes give, per half the point's mass.
template <int Dim, class Shape>
double turn_point(Points<Dim>& points, int p, const Stencil<Dim, Shape>& stencil, int lane,
                  const MotionRow<Dim> (&moment)[Dim], double dt, double keep) {
  using M = NodeMotion<Dim>;
  double given = 0;
  for_spins<Dim>([&](int s, int i, int j) {
    const double inertia = stencil.spread[i][lane] + stencil.spread[j][lane];
    if (!(inertia > 0)) return;  // on a node of linear shapes: it gives no momentum either
    const auto curl = [&](int first) { return (moment[i][first + j] - moment[j][first + i]) / inertia; };
    double& w = points.column(PointColumns<Dim>::spin + s)[p];
    const double turned = w + dt * curl(M::acceleration);
    given += inertia * (turned * turned - w * w);
    w = keep * turned + (1.0 - keep) * curl(M::velocity);
  });
  return given;
}

/// v_p += dt sum N a, blended with sum N v; and spin. Returns the energy that blending takes from the velocity and the
/// nodes give to the spin, per half the point's mass.
template <int Dim, class Shape>
double accelerate_point(Points<Dim>& points, int p, const Stencil<Dim, Shape>& stencil, int lane,
                        const PointMotion<Dim>& m, double dt, const TransferSettings<Dim>& settings) {
  using M = NodeMotion<Dim>;
  double energy = 0;
  if constexpr (Stencil<Dim, Shape>::spinning) {
    double squared = 0;  // of the cells that the point moves in this step
    for (int d = 0; d < Dim; ++d) squared += std::pow(dt * m.sum[M::velocity + d] * stencil.inverse_spacing[d], 2);
    const double relaxed = std::min(1.0, settings.spin_relaxation * std::sqrt(squared));
    energy = turn_point(points, p, stencil, lane, m.moment, dt, settings.flip * (1.0 - relaxed));
  }
  for (int d = 0; d < Dim; ++d) {
    double& v = points.column(PointColumns<Dim>::velocity + d)[p];
    v += dt * m.sum[M::acceleration + d];
    if (settings.flip == 1.0) continue;
    const double updated = v;
    v = settings.flip * updated + (1.0 - settings.flip) * m.sum[M::velocity + d];
    energy += updated * updated - v * v;
  }
  return energy;
}

/// accelerate_point for eight points, calling after(lane, motion) for each. Returns the energy [J].
template <int Dim, class Shape, class F>
double accelerate_points(Piece<Dim>& piece, int first, int count, const Stencil<Dim, Shape>& stencil, double density,
                         double dt, const TransferSettings<Dim>& settings, F&& after) {
  double energy = 0;
  for (int lane = 0; lane < count; ++lane) {
    const PointMotion<Dim> m = gather_motion(stencil, lane, piece.nodes.motion.data());
    const double half_mass = 0.5 * density * piece.points.column(PointColumns<Dim>::volume)[first + lane];
    energy += half_mass * accelerate_point(piece.points, first + lane, stencil, lane, m, dt, settings);
    after(lane, m);
  }
  return energy;
}

template <int Dim, class Shape>
void scatter_momentum(const Points<Dim>& points, int p, const Stencil<Dim, Shape>& stencil, int lane, double density,
                      double* momentum) {
  const double mass = density * points.column(PointColumns<Dim>::volume)[p];
  scatter_moving<no_gradient>(points, p, stencil, lane, mass, Lanes4{}, momentum);
}

/// The walls, which no point crosses.
template <int Dim>
struct Walls {
  Vec<Dim> lower, upper, lower_way, upper_way;  // at the end of the step, and how far they came

  Walls(const TransferSettings<Dim>& settings) {
    constexpr double nowhere = std::numeric_limits<double>::infinity();
    for (int d = 0; d < Dim; ++d) {
      const auto &from = settings.wall_from[d], &to = settings.wall_to[d];
      lower[d] = settings.walled[d][0] ? to[0] : -nowhere, lower_way[d] = to[0] - from[0];
      upper[d] = settings.walled[d][1] ? to[1] : nowhere, upper_way[d] = to[1] - from[1];
    }
  }
  /// Where a point that moves from a to b stops; one that is beyond already goes no further, seen from the wall.
  double stop(int d, double a, double b) const {
    return std::min(std::max(b, std::min(a + lower_way[d], lower[d])), std::max(a + upper_way[d], upper[d]));
  }
};

/// a b + c with one rounding where the machine can. Left to the compiler it would depend on the code around, and the
/// time step on it.
inline double multiply_add(double a, double b, double c) {
#ifdef FP_FAST_FMA
  return std::fma(a, b, c);
#else
  return a * b + c;
#endif
}

/// x_p += dt sum N v, up to the walls; returns the larger of `fastest` and its squared speed, infinite where that is
/// not finite.
template <int Dim>
double move(Points<Dim>& points, int p, const PointMotion<Dim>& m, const Walls<Dim>& walls, double dt, double fastest,
            std::int64_t& stopped) {
  using C = PointColumns<Dim>;
  double squared = 0;
  for (int d = 0; d < Dim; ++d) {
    double& x = points.column(d)[p];
    const double free = x + dt * m.sum[NodeMotion<Dim>::velocity + d];
    x = walls.stop(d, x, free);
    stopped += x != free && free == free;
    const double v = points.column(C::velocity + d)[p];
    squared = multiply_add(v, v, squared);
  }
  return squared <= std::numeric_limits<double>::max() ? std::max(fastest, squared)
                                                       : std::numeric_limits<double>::infinity();
}

/// Calls f(first, count, stencil) for every eight points of the piece; `arrays` as in for_chunks.
template <int Dim, class F>
void for_piece(const Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
               std::initializer_list<RowArray> arrays, F&& f) {
  with_shape(settings, piece, [&](const auto& shape) { for_chunks(piece, lattice, shape, arrays, f); });
}

/// As for_piece, with spin where points carry it.
template <int Dim, class F>
void for_moving_piece(const Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                      std::initializer_list<RowArray> arrays, F&& f) {
  with_moving_shape(settings, piece, [&](const auto& shape) { for_chunks(piece, lattice, shape, arrays, f); });
}

/// The arrays of nodes that passes read or add to.
template <int Dim>
RowArray velocity_of(Piece<Dim>& piece) {
  return read_rows(piece.nodes.velocity, vector_width);
}
template <int Dim>
RowArray motion_of(Piece<Dim>& piece) {
  return read_rows(piece.nodes.motion, NodeMotion<Dim>::width);
}
template <int Dim>
RowArray to_momentum_of(Piece<Dim>& piece) {
  return add_rows(piece.nodes.velocity, vector_width);
}
template <int Dim>
RowArray to_force_of(Piece<Dim>& piece) {
  return add_rows(piece.nodes.force, vector_width);
}

}  // namespace

template <int Dim>
void update_stress_and_move(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                            const Law& law, double density, double strain_dt, double dt, SpeedLimits& speeds) {
  double fastest_wave = speeds.wave * speeds.wave, fastest_point = speeds.point * speeds.point;
  const Walls<Dim> walls(settings);
  std::visit(
      [&](const auto& any) {
        const auto& concrete = law_of_step(any, strain_dt);
        for_piece(piece, lattice, settings, {velocity_of(piece), motion_of(piece)},
                  [&](int first, int count, const auto& stencil) {
                    const auto A = gather_strain(stencil, count, piece.nodes.velocity.data(), strain_dt);
                    fastest_wave = apply_law(piece.points, first, count, concrete, A, 1.0 / density, fastest_wave);
                    for (int lane = 0; lane < count; ++lane) {
                      const auto m = gather_motion(stencil, lane, piece.nodes.motion.data());
                      fastest_point = move(piece.points, first + lane, m, walls, dt, fastest_point, speeds.stopped);
                    }
                  });
      },
      law);
  speeds.wave = std::sqrt(fastest_wave), speeds.point = std::sqrt(fastest_point);
}

template <int Dim>
void update_stress(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                   const Law& law, double density, double dt, SpeedLimits& speeds) {
  double fastest = speeds.wave * speeds.wave;
  std::visit(
      [&](const auto& any) {
        const auto& concrete = law_of_step(any, dt);
        for_piece(piece, lattice, settings, {velocity_of(piece)}, [&](int first, int count, const auto& stencil) {
          const auto A = gather_strain(stencil, count, piece.nodes.velocity.data(), dt);
          fastest = apply_law(piece.points, first, count, concrete, A, 1.0 / density, fastest);
        });
      },
      law);
  speeds.wave = std::sqrt(fastest);
}

template <int Dim>
void strain_alike(Piece<Dim>& piece, const Law& law, double density, const Vec<Dim>& strain, double dt,
                  SpeedLimits& speeds) {
  double fastest = speeds.wave * speeds.wave;
  Tensor<Dim, Lanes> A{};
  for (int d = 0; d < Dim; ++d) A.c[tensor_index<Dim>(d, d)] = Lanes{} + strain[d];
  std::visit(
      [&](const auto& any) {
        const auto& concrete = law_of_step(any, dt);
        for (int first = 0; first < piece.points.size(); first += lane_count)
          fastest = apply_law(piece.points, first, std::min(lane_count, piece.points.size() - first), concrete, A,
                              1.0 / density, fastest);
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
      [&](const auto& any) {
        const auto& concrete = law_of_step(any, dt);
        for_piece(piece, lattice, settings, {velocity_of(piece), to_force_of(piece)},
                  [&](int first, int count, const auto& stencil) {
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
  double energy = 0;
  for_moving_piece(piece, lattice, settings, {motion_of(piece)}, [&](int first, int count, const auto& stencil) {
    energy +=
        accelerate_points(piece, first, count, stencil, density, dt, settings, [](int, const PointMotion<Dim>&) {});
  });
  return energy;
}

template <int Dim>
double accelerate_and_move(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                           double density, double dt, SpeedLimits& speeds) {
  double energy = 0, fastest = speeds.point * speeds.point;
  const Walls<Dim> walls(settings);
  for_moving_piece(piece, lattice, settings, {motion_of(piece)}, [&](int first, int count, const auto& stencil) {
    energy += accelerate_points(piece, first, count, stencil, density, dt, settings, [&](int lane, const auto& m) {
      fastest = move(piece.points, first + lane, m, walls, dt, fastest, speeds.stopped);
    });
  });
  speeds.point = std::sqrt(fastest);
  return energy;
}

template <int Dim>
void project_momentum(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                      double density) {
  piece.nodes.velocity.assign(piece.nodes.storage() * vector_width, 0.0);
  for_moving_piece(piece, lattice, settings, {to_momentum_of(piece)}, [&](int first, int count, const auto& stencil) {
    for (int lane = 0; lane < count; ++lane)
      scatter_momentum(piece.points, first + lane, stencil, lane, density, piece.nodes.velocity.data());
  });
}

template <int Dim>
double accelerate_and_project(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                              double density, double dt) {
  double energy = 0;
  piece.nodes.velocity.assign(piece.nodes.storage() * vector_width, 0.0);
  for_moving_piece(
      piece, lattice, settings, {motion_of(piece), to_momentum_of(piece)},
      [&](int first, int count, const auto& stencil) {
        energy += accelerate_points(piece, first, count, stencil, density, dt, settings, [&](int lane, const auto&) {
          scatter_momentum(piece.points, first + lane, stencil, lane, density, piece.nodes.velocity.data());
        });
      });
  return energy;
}

template <int Dim>
void subtract_seen(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings) {
  using C = PointColumns<Dim>;
  using M = NodeMotion<Dim>;
  NodeBox<Dim>& nodes = piece.nodes;
  nodes.motion.assign(nodes.storage() * M::width, 0.0);
  for (std::size_t node = 0; node < nodes.rows(); ++node)
    std::copy_n(nodes.velocity.data() + node * vector_width, Dim, nodes.motion.data() + node * M::width + M::velocity);
  for_moving_piece(piece, lattice, settings, {motion_of(piece)},
                   [&]<class Shape>(int first, int count, const Stencil<Dim, Shape>& stencil) {
                     for (int lane = 0; lane < count; ++lane) {
                       const PointMotion<Dim> m = gather_motion(stencil, lane, nodes.motion.data());
                       for (int d = 0; d < Dim; ++d)
                         piece.points.column(C::velocity + d)[first + lane] -= m.sum[M::velocity + d];
                       if constexpr (Stencil<Dim, Shape>::spinning)
                         for_spins<Dim>([&](int s, int i, int j) {
                           const double inertia = stencil.spread[i][lane] + stencil.spread[j][lane];
                           double& w = piece.points.column(C::spin + s)[first + lane];
                           const double curl = m.moment[i][M::velocity + j] - m.moment[j][M::velocity + i];
                           w = inertia > 0 ? w - curl / inertia : 0.0;
                         });
                     }
                   });
}

template <int Dim>
std::vector<std::array<double, spin_size<Dim>>> spin_inertia(const Piece<Dim>& piece, const Lattice<Dim>& lattice,
                                                             const TransferSettings<Dim>& settings) {
  std::vector<std::array<double, spin_size<Dim>>> inertia(piece.points.size());
  Box<Dim> everywhere;  // the points may have moved since the piece's own box was laid out
  for (int d = 0; d < Dim; ++d) everywhere.lower[d] = -2, everywhere.upper[d] = lattice.cells()[d] + 3;
  if (!settings.spin) return inertia;
  AlignedDoubles domains;  // those that the piece has may be of other points
  if (settings.shape == ShapeFunction::cpdi)
    domains = domains_of(piece.points, settings.stretch_of(piece.body), lattice, settings);
  with_shape(settings, domains, piece.points.size(), [&]<class Shape>(const Shape& shape) {
    for_chunks(piece.points, lattice, everywhere, Spinning<Shape>{shape},
               [&](int first, int count, const Stencil<Dim, Spinning<Shape>>& stencil) {
                 for (int lane = 0; lane < count; ++lane)
                   for_spins<Dim>([&](int s, int i, int j) {
                     inertia[first + lane][s] = stencil.spread[i][lane] + stencil.spread[j][lane];
                   });
               });
  });
  return inertia;
}

#define CAIRN_INSTANTIATE(Dim)                                                                                        \
  template void update_stress_and_move(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, const Law&,    \
                                       double, double, double, SpeedLimits&);                                         \
  template void update_stress(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, const Law&, double,     \
                              double, SpeedLimits&);                                                                  \
  template void strain_alike(Piece<Dim>&, const Law&, double, const Vec<Dim>&, double, SpeedLimits&);                 \
  template void update_stress_and_force(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, const Law&,   \
                                        double, double, SpeedLimits&);                                                \
  template double accelerate(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double, double);         \
  template void project_momentum(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double);             \
  template double accelerate_and_project(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double,      \
                                         double);                                                                     \
  template double accelerate_and_move(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&, double, double, \
                                      SpeedLimits&);                                                                  \
  template void subtract_seen(Piece<Dim>&, const Lattice<Dim>&, const TransferSettings<Dim>&);                        \
  template std::vector<std::array<double, spin_size<Dim>>> spin_inertia(const Piece<Dim>&, const Lattice<Dim>&,       \
                                                                        const TransferSettings<Dim>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
