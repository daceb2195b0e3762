#pragma once
/// Cases with cracks, for tests.

#include <functional>

#include "cairn/core/error.hpp"
#include "cases.hpp"

namespace cairn::test {

using Line = std::vector<Vec3>;

inline void add_crack(Case& c, const Line& points, CrackLaw law, double friction = 0.3) {
  CrackSpec crack;
  crack.points = points, crack.law = law, crack.friction = friction, crack.source = "test";
  c.cracks.push_back(crack);
}

/// A block of 14 cells in a square of 24, patches of 6 cells: cracks go through several.
inline Case block_at_rest() {
  Case c = soft_case(2, 24, 6);
  add_body(c, BoxShape{Vec3(5.0 / 24, 5.0 / 24, 0), Vec3(19.0 / 24, 19.0 / 24, 0)});
  return c;
}
/// It falls and shakes.
inline Case falling_block() {
  Case c = block_at_rest();
  c.domain.gravity = Vec3(0.3, -1, 0);
  c.bodies[0].angular_velocity = Vec3(0, 0, 0.5);
  c.bodies[0].velocity = Vec3(0.1, 0.05, 0);
  return c;
}
/// 4 long, .4 high, 10 cells a unit: four by one patches of 10 cells.
inline Case long_bar() {
  Case c = soft_case(2, 40, 10);
  c.domain.upper = Vec3(4, 1, 0), c.domain.cells = {80, 20, 1};
  add_body(c, BoxShape{Vec3(0.1, 0.3, 0), Vec3(3.9, 0.7, 0)});
  return c;
}

inline std::vector<Line> straight_crack() {
  return {{Vec3(0.1, 0.5, 0), Vec3(0.9, 0.5, 0)}};  // on a grid line, through nodes
}
inline std::vector<Line> wavy_crack() {
  Line line;
  for (int i = 0; i <= 16; ++i) line.push_back(Vec3(0.1 + 0.05 * i, 0.5031 + 0.05 * std::sin(i), 0));
  return {line};
}
inline std::vector<Line> inner_crack() { return {{Vec3(0.3517, 0.4071, 0), Vec3(0.6213, 0.5577, 0)}}; }
inline std::vector<Line> crossing_cracks() {
  return {{Vec3(0.1, 0.5, 0), Vec3(0.9, 0.5, 0)}, {Vec3(0.5, 0.1, 0), Vec3(0.5, 0.9, 0)}};
}
/// Lines through the middle of the block, at equal angles.
inline std::vector<Line> star_cracks(int count) {
  std::vector<Line> lines;
  for (int k = 0; k < count; ++k) {
    const double angle = M_PI * k / count + (count == 2 ? 0.0 : 0.1);
    const Vec3 e(std::cos(angle), std::sin(angle), 0);
    lines.push_back({Vec3(0.5, 0.5, 0) - 0.45 * e, Vec3(0.5, 0.5, 0) + 0.45 * e});
  }
  return lines;
}

inline std::map<std::int64_t, SolverPoint<2>> run(const Case& c, int steps) {
  Simulation<2> simulation(c, MPI_COMM_SELF);
  for (int i = 0; i < steps; ++i) simulation.step(1e300);
  return points_of(simulation);
}

/// Sets the points' velocities from their positions.
inline void set_velocities(Simulation<2>& simulation, const std::function<Vec<2>(const Vec<2>&)>& velocity) {
  using C = PointColumns<2>;
  for (auto& patch : simulation.patches())
    for (auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p) {
        const Vec<2> v = velocity(Vec<2>(piece.points.column(0)[p], piece.points.column(1)[p]));
        for (int d = 0; d < 2; ++d) piece.points.column(C::velocity + d)[p] = v[d];
      }
}

}  // namespace cairn::test
