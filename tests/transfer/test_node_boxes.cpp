// Points within a rounding error of where a shape function takes up the next node. The compiler may round there one way
// where the node box is laid out and another way where the nodes are visited: they are visited within the box.

#include <gtest/gtest.h>

#include "../support/piece_setup.hpp"
#include "cairn/grid/shape_functions.hpp"

namespace cairn {
namespace {

using namespace test;

/// Calls f(lattice, piece) for pieces of one point at the lower edge or the middle of a cell or some rounding errors
/// beside it, on lattices of several widths.
template <class F>
void for_edge_points(const TransferSettings<2>& settings, F&& f) {
  Random random(11);
  for (int i = 0; i < 100; ++i) {
    const double width = random(0.001, 1.0);
    const Lattice<2> lattice(Vec<2>(0, 0), Vec<2>(width, width), {300, 300}, {false, false}, 300);
    for (double place : {0.5, 1.0, 1.5, 63.5, 150.5, 299.5})
      for (int error = -3; error <= 3; ++error) {
        double x = place * lattice.spacing()[0];
        for (int k = 0; k < std::abs(error); ++k) x = std::nextafter(x, error < 0 ? -1.0 : 2.0);
        Piece<2> piece(0, 0);
        piece.points.resize(1);
        put_point<2>(piece.points, 0, {Vec<2>(x, x), Vec<2>(1, 2), Mat3::Identity(), Mat3::Identity(), 1e-3});
        lay_out_nodes(piece, lattice, settings);
        f(lattice, piece);
      }
  }
}

template <class Shape>
void check_stencil(const Shape& shape, const Lattice<2>& lattice, const Piece<2>& piece) {
  const double* x[2] = {piece.points.column(0), piece.points.column(1)};
  const Stencil<2, Shape> stencil(lattice, shape, piece.nodes.box, x);
  double sum = 0;
  stencil.for_nodes(0, [&](int node, double w, const double(&)[2]) {
    EXPECT_GE(node, 0);
    EXPECT_LT(node, static_cast<int>(piece.nodes.box.size()));
    sum += w;
  });
  EXPECT_NEAR(sum, 1, round_off);
}

TransferSettings<2> settings_of(ShapeFunction kind, int points_per_cell, bool spin) {
  SolverOptions solver;
  solver.shape = kind, solver.points_per_cell = points_per_cell, solver.spin = spin;
  auto settings = TransferSettings<2>::make(solver, ContactOptions{}, Vec<2>::Zero());
  settings.normals_needed = false;
  return settings;
}

TEST(NodeBoxes, HoldTheNodesOfPointsAtTheEdgeOfTheirReach) {
  for (int points_per_cell : {1, 4}) {
    const auto gimp = settings_of(ShapeFunction::gimp, points_per_cell, false);
    for_edge_points(
        gimp, [&](const auto& lattice, auto& piece) { check_stencil(GimpShape{gimp.half_size}, lattice, piece); });
  }
  for_edge_points(settings_of(ShapeFunction::bspline2, 1, false),
                  [](const auto& lattice, auto& piece) { check_stencil(QuadraticShape{}, lattice, piece); });
  for_edge_points(settings_of(ShapeFunction::linear, 1, false),
                  [](const auto& lattice, auto& piece) { check_stencil(LinearShape{}, lattice, piece); });
}

/// All passes over such points; the address sanitizer sees where they read and write.
TEST(NodeBoxes, PassesStayWithinThem) {
  const Law law = make_law("neo_hookean", {{"shear_modulus", 3e5}, {"bulk_modulus", 7e5}});
  for (ShapeFunction kind : {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline2})
    for (bool spin : {false, true}) {
      const auto settings = settings_of(kind, 1, spin);
      for_edge_points(settings, [&](const auto& lattice, auto& piece) {
        SpeedLimits speeds;
        project(piece, lattice, settings, density);
        velocity_from_sums(piece);
        update_stress_and_force(piece, lattice, settings, law, density, 1e-9, speeds);
        integrate(piece, 1e-9);
        accelerate_and_project(piece, lattice, settings, density, 1e-9);
        update_stress_and_move(piece, lattice, settings, law, density, 1e-9, 1e-9, speeds);
        EXPECT_NEAR(piece.points.column(PointColumns<2>::velocity)[0], 1, 1e-3);
      });
    }
}

}  // namespace
}  // namespace cairn
