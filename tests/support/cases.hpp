#pragma once
/// Cases built in code, and the state of all points of a simulation.

#include <map>
#include <vector>

#include "cairn/solver/simulation.hpp"

namespace cairn::test {

constexpr double soft_bulk = 8e3;  // of `soft_case` [Pa]

/// A unit square or cube of `cells` cells in each direction and one soft neo-Hookean material.
inline Case soft_case(int dimension, int cells, int patch_cells) {
  Case c;
  c.domain.dimension = dimension;
  c.domain.upper = dimension == 2 ? Vec3(1, 1, 0) : Vec3(1, 1, 1);
  c.domain.cells = {cells, cells, dimension == 2 ? 1 : cells};
  c.domain.patch_cells = patch_cells;
  c.time.cfl = 0.3;
  c.solver.points_per_cell = 1 << dimension;
  c.materials.push_back({"soft", "neo_hookean", 1000, {{"shear_modulus", 4e3}, {"bulk_modulus", soft_bulk}}});
  return c;
}

inline void add_body(Case& c, const Shape& shape, const Vec3& velocity = Vec3::Zero(),
                     const Vec3& spin = Vec3::Zero()) {
  BodySpec body;
  body.shape = shape, body.velocity = velocity, body.angular_velocity = spin, body.source = "test";
  c.bodies.push_back(body);
}

/// Two balls (disks in 2D) that meet obliquely, off the grid by odd fractions of a cell, one larger than the other.
inline Case colliding_balls(int dimension, int cells, int patch_cells) {
  Case c = soft_case(dimension, cells, patch_cells);
  const double z = dimension == 3 ? 1 : 0;
  add_body(c, Ball{Vec3(0.3137, 0.3911, 0.47 * z), 0.19}, Vec3(0.5, 0.1, 0.2 * z), Vec3(0, 0, 1));
  add_body(c, Ball{Vec3(0.6941, 0.5729, 0.561 * z), 0.22}, Vec3(-0.6, -0.2, 0), Vec3(0.5 * z, 0, 0.3));
  return c;
}

template <int Dim>
struct SolverPoint {
  int body;
  Vec<Dim> x, v;  // x continuous across periodic boundaries
  Tensor<Dim, double> F;
  Symmetric<Dim, double> stress;
  double mass;
};

/// All points of this rank by id.
template <int Dim>
std::map<std::int64_t, SolverPoint<Dim>> points_of(const Simulation<Dim>& simulation) {
  using C = PointColumns<Dim>;
  std::map<std::int64_t, SolverPoint<Dim>> all;
  for (const auto& patch : simulation.patches())
    for (const auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p) {
        const auto& points = piece.points;
        SolverPoint<Dim> at;
        at.body = piece.body;
        for (int d = 0; d < Dim; ++d) {
          at.x[d] = points.column(d)[p] + points.images()[p][d] * simulation.lattice().length(d);
          at.v[d] = points.column(C::velocity + d)[p];
        }
        for (int i = 0; i < tensor_size<Dim>; ++i) at.F.c[i] = points.column(C::deformation + i)[p];
        for (int i = 0; i < symmetric_size<Dim>; ++i) at.stress.c[i] = points.column(C::stress + i)[p];
        at.mass = simulation.material_of(piece).density * points.column(C::volume)[p];
        all.emplace(points.ids()[p], at);
      }
  return all;
}

/// Largest stress component [Pa].
template <int Dim>
double largest_stress(const Simulation<Dim>& simulation) {
  double largest = 0;
  for (const auto& [id, point] : points_of(simulation))
    for (double s : point.stress.c) largest = std::max(largest, std::abs(s));
  return largest;
}

}  // namespace cairn::test
