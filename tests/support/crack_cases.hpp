#pragma once
/// Cases with cracks, for tests.

#include <gtest/gtest.h>

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

/// A line drawn out, in 3D.
inline void add_sheet(Case& c, const Line& points, const Vec3& extrude, CrackLaw law, double friction = 0.3) {
  add_crack(c, points, law, friction);
  c.cracks.back().extrude = extrude;
}
inline void add_disk(Case& c, const Vec3& centre, const Vec3& normal, double radius, CrackLaw law) {
  add_crack(c, {}, law);
  c.cracks.back().disk = CrackDisk{centre, normal, radius};
}
/// The cracks of 2D, drawn out through the whole depth.
inline void add_sheets(Case& c, const std::vector<Line>& lines, CrackLaw law, double friction = 0.3) {
  for (Line line : lines) {
    for (Vec3& x : line) x.z() = 0.15;
    add_sheet(c, line, Vec3(0, 0, 0.7), law, friction);
  }
}
/// A block of 8 cells in a cube of 12, patches of 6 cells.
inline Case block_at_rest_3d() {
  Case c = soft_case(3, 12, 6);
  add_body(c, BoxShape{Vec3(1.0 / 6, 1.0 / 6, 1.0 / 6), Vec3(5.0 / 6, 5.0 / 6, 5.0 / 6)});
  return c;
}
/// Three planes through the middle.
inline void add_planes(Case& c, CrackLaw law) {
  add_sheet(c, {Vec3(0.1, 0.5, 0.1), Vec3(0.9, 0.5, 0.1)}, Vec3(0, 0, 0.8), law);
  add_sheet(c, {Vec3(0.5, 0.1, 0.1), Vec3(0.5, 0.9, 0.1)}, Vec3(0, 0, 0.8), law);
  add_sheet(c, {Vec3(0.1, 0.1, 0.5), Vec3(0.9, 0.1, 0.5)}, Vec3(0, 0.8, 0), law);
}

template <int Dim = 2>
std::map<std::int64_t, SolverPoint<Dim>> run(const Case& c, int steps) {
  Simulation<Dim> simulation(c, MPI_COMM_SELF);
  for (int i = 0; i < steps; ++i) simulation.step(1e300);
  return points_of(simulation);
}

/// Sets the points' velocities from their positions.
template <int Dim, class F>
void set_velocities(Simulation<Dim>& simulation, F&& velocity) {
  using C = PointColumns<Dim>;
  for (auto& patch : simulation.patches())
    for (auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p) {
        Vec<Dim> x;
        for (int d = 0; d < Dim; ++d) x[d] = piece.points.column(d)[p];
        const Vec<Dim> v = velocity(x);
        for (int d = 0; d < Dim; ++d) piece.points.column(C::velocity + d)[p] = v[d];
      }
}

/// Cohesive law of halves that are pulled apart, of strength M/100 and the critical opening .2 (of a triangle).
inline void set_pulled_law(CohesiveSpec& law, CohesiveShape shape, double M) {
  law.shape = shape, law.strength = {0.01 * M, 0.01 * M}, law.energy = {0.001 * M, 0.001 * M}, law.peak = 0.3;
}

/// A block that stands on a base, both of one body, under a gravity of 10 that is turned by 30 degrees; a crack with
/// mu = .3 between them, at the height `plane`. It slides with x = g (sin - mu cos) t^2/2, and friction takes
/// mu m g cos x. \param under  whether a place lies under the block as it stood at the start
template <int Dim, class Under>
void check_sliding(Case c, double plane, Under&& under) {
  c.domain.gravity = Vec3(10 * Vec3(0.5, -std::sqrt(0.75), 0));
  // Stiff: what the block slips while gravity comes on is lost for the comparison.
  c.materials[0].parameters = {{"shear_modulus", 1.2e7}, {"bulk_modulus", 2.4e7}};
  c.faces[2].type = FaceType::fixed;
  Simulation<Dim> simulation(c, MPI_COMM_SELF);
  const auto start = points_of(simulation);
  const Totals before = simulation.totals();
  while (simulation.time() < 0.6) simulation.step(0.6 - simulation.time());
  double mass = 0, x = 0, v = 0;
  for (const auto& [id, a] : points_of(simulation)) {
    if (start.at(id).x.y() < plane) continue;
    mass += a.mass, x += a.mass * (a.x.x() - start.at(id).x.x()), v += a.mass * a.v.x();
  }
  x /= mass, v /= mass;
  const double a = 10 * (0.5 - 0.3 * std::sqrt(0.75)), friction = 0.3 * mass * 10 * std::sqrt(0.75) * 0.5 * a * 0.36;
  const Totals after = simulation.totals();
  const double taken = after.contact_dissipation - before.contact_dissipation;
  std::printf("x %.4f, v %.4f, friction %.4f of the exact ones\n", x / (0.5 * a * 0.36), v / (a * 0.6),
              taken / friction);
  EXPECT_NEAR(x / (0.5 * a * 0.36), 1, 0.03);
  EXPECT_NEAR(v / (a * 0.6), 1, 0.02);
  EXPECT_NEAR(taken / friction, 1, 0.04);
  EXPECT_NEAR(after.energy(), before.energy(), 0.01 * friction);
  for (const auto& patch : simulation.patches())
    for (const auto& point : patch.cracks) {
      Vec<Dim> then = point.plane;
      then.x() -= x;
      if (!point.own || !under(then)) continue;
      EXPECT_GT(point.opening().y(), -0.01 * 0.1) << "faces went through each other at " << point.plane.transpose();
    }
}

}  // namespace cairn::test
