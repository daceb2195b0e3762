// The smooth field of stress on any number of ranks: linear fields stay, noise goes, every bit is that of one rank, and
// the run goes on as if nobody had asked.

#include <gtest/gtest.h>
#include <mpi.h>

#include "../support/cases.hpp"
#include "../support/random.hpp"

namespace cairn {
namespace {

using namespace test;

template <int Dim>
using StressRow = std::array<double, symmetric_size<Dim>>;

/// The smooth stress of every point of this rank, by id.
template <int Dim>
std::map<std::int64_t, StressRow<Dim>> smooth_field(Simulation<Dim>& simulation) {
  simulation.project_stress();
  std::map<std::int64_t, StressRow<Dim>> all;
  for (const auto& patch : std::as_const(simulation).patches())
    for (const auto& piece : patch.pieces) {
      const auto smooth = smooth_stress(piece, simulation.lattice(), simulation.transfer());
      for (int p = 0; p < piece.points.size(); ++p) all.emplace(piece.points.ids()[p], smooth[p]);
    }
  return all;
}

/// Gives every point the stress value(body, position, component).
template <int Dim, class F>
void set_stress(Simulation<Dim>& simulation, F&& value) {
  for (auto& patch : simulation.patches())
    for (auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p) {
        Vec<Dim> x;
        for (int d = 0; d < Dim; ++d) x[d] = piece.points.column(d)[p];
        for (int i = 0; i < symmetric_size<Dim>; ++i)
          piece.points.column(PointColumns<Dim>::stress + i)[p] = value(piece.body, x, i);
      }
}

constexpr int cells = 12;

/// A block on a symmetry plane, its other faces a cell and a half from those of the domain, and one on top of it.
Case blocks(int dimension, ShapeFunction shape) {
  Case c = soft_case(dimension, cells, 4);
  c.solver.shape = shape;
  const double h = 1.0 / cells, back = dimension == 2 ? -1 : 1.5 * h;
  add_body(c, BoxShape{Vec3(1.5 * h, 0, back), Vec3(10.5 * h, 8 * h, 10.5 * h), 0});
  add_body(c, BoxShape{Vec3(1.5 * h, 8 * h, back), Vec3(10.5 * h, 12 * h, 10.5 * h), 0});
  c.faces[2].type = FaceType::symmetry;
  return c;
}

/// Normal stresses are even in the distance from a symmetry plane (y = 0), shear across it is odd: both linear fields.
template <int Dim>
double linear(int body, const Vec<Dim>& x, int component) {
  const bool across = Dim == 2 ? component == 3 : component == 3 || component == 4;  // xy, yz
  return body == 1 ? -7.0 : across ? 5 * x[1] : 3 + component + 2 * x[0] - (Dim == 3 ? x[Dim - 1] : 0.0);
}

template <int Dim>
void check_linear(ShapeFunction shape) {
  SCOPED_TRACE(testing::Message() << "shape " << static_cast<int>(shape) << " in " << Dim << "D");
  Simulation<Dim> simulation(blocks(Dim, shape), MPI_COMM_WORLD);
  set_stress(simulation, linear<Dim>);
  const auto smooth = smooth_field(simulation);
  const double h = 1.0 / cells;
  double inside = 0, anywhere = 0;
  int of_the_plane = 0;
  for (const auto& [id, point] : points_of(simulation)) {
    bool deep = point.body == 1 || point.x[1] < 5 * h;
    for (int d = 0; d < Dim; d += 2) deep = deep && (point.body == 1 || std::abs(point.x[d] - 0.5) < 1.5 * h);
    of_the_plane += deep && point.body == 0 && point.x[1] < h;
    for (int i = 0; i < symmetric_size<Dim>; ++i) {
      const double error = std::abs(smooth.at(id)[i] - point.stress.c[i]);
      anywhere = std::max(anywhere, error);
      if (deep) inside = std::max(inside, error);
    }
  }
  EXPECT_LE(inside, 1e-12);  // the other body, too, has no part in it
  EXPECT_LE(anywhere, 7 * h);
  MPI_Allreduce(MPI_IN_PLACE, &of_the_plane, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
  EXPECT_GT(of_the_plane, 0);
}
TEST(StressField, LinearFieldsStay) {
  for (ShapeFunction shape : {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline2}) {
    check_linear<2>(shape);
    check_linear<3>(shape);
  }
}

/// Stress of the points of a cell that alternates in sign is seen by no node.
TEST(StressField, NoiseGoes) {
  Simulation<2> simulation(blocks(2, ShapeFunction::gimp), MPI_COMM_WORLD);
  set_stress(simulation, [](int, const Vec<2>& x, int) {
    const auto column = static_cast<int>(std::floor(x[0] * cells * 2)), row = static_cast<int>(x[1] * cells * 2);
    return 10.0 + ((column + row) % 2 == 0 ? 1 : -1);
  });
  for (const auto& [id, stress] : smooth_field(simulation))
    for (int i : {0, 1, 2}) EXPECT_NEAR(stress[i], 10, 0.26);  // shear vanishes on the plane of symmetry
  const auto smooth = smooth_field(simulation);
  for (const auto& [id, point] : points_of(simulation))
    if ((point.x - Vec<2>(0.5, 0.35)).cwiseAbs().maxCoeff() < 2.5 / cells) {
      EXPECT_NEAR(smooth.at(id)[0], 10, 1e-12);
    }
}

template <int Dim>
void check_bits(Case c, int steps) {
  c.parallel.partition = Partition::round_robin;
  Simulation<Dim> shared(c, MPI_COMM_WORLD), alone(c, MPI_COMM_SELF), unasked(c, MPI_COMM_SELF);
  double largest = 0;
  for (int i = 0; i < steps; ++i) {
    shared.step(1e300), alone.step(1e300), unasked.step(1e300);
    if (i % 10 != 9) continue;
    const auto mine = smooth_field(shared), all = smooth_field(alone);
    for (const auto& [id, stress] : mine) {
      ASSERT_EQ(stress, all.at(id)) << "point " << id;
      for (double s : stress) largest = std::max(largest, std::abs(s));
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  EXPECT_GT(largest, 0.01 * soft_bulk) << "the bodies did not meet";
  const auto asked = points_of(alone), not_asked = points_of(unasked);
  ASSERT_EQ(asked.size(), not_asked.size());
  for (const auto& [id, a] : asked) {
    ASSERT_EQ(a.x, not_asked.at(id).x);
    ASSERT_EQ(a.v, not_asked.at(id).v);
  }
}
TEST(StressField, SameBitsAndNoTrace) {
  check_bits<2>(colliding_balls(2, 24, 4), 70);
  check_bits<3>(colliding_balls(3, 12, 4), 30);
}

}  // namespace
}  // namespace cairn
