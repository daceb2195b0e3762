// Spin of points: what it gives to the nodes and takes from them.

#include <gtest/gtest.h>

#include "../support/piece_setup.hpp"

namespace cairn {
namespace {

using namespace test;

/// Points -> nodes -> points: the angular momentum of points and nodes is the same, before and after forces act, and
/// the points gain the energy that the forces spend, sum f dt . (v + v')/2 with v' projected again.
template <int Dim>
void check_spin_conservation(PieceSetup<Dim>& s) {
  if (!s.settings.spin) return;
  using N = NodeSums<Dim>;
  const double dt = 0.01;
  s.settings.spin_relaxation = 0;
  const auto inertia = spin_inertia(s.piece, s.lattice, s.settings);
  const auto points = [&] {
    std::pair<Vec3, double> sum{Vec3::Zero(), 0};
    for (int p = 0; p < point_count; ++p) {
      const auto at = get_point(s.piece.points, p);
      Vec3 x = Vec3::Zero(), v = Vec3::Zero(), own = Vec3::Zero();
      x.head<Dim>() = at.x, v.head<Dim>() = at.v;
      for (int c = 0; c < spin_size<Dim>; ++c) own[Dim == 2 ? 2 : c] = inertia[p][c] * at.spin[Dim == 2 ? 2 : c];
      const double mass = density * at.volume0;
      sum.first += mass * (x.cross(v) + own);
      sum.second += 0.5 * mass * (v.squaredNorm() + own.dot(at.spin));
    }
    return sum;
  };
  const auto moment = [&](const Eigen::MatrixXd& vectors) {
    Vec3 sum = Vec3::Zero();
    for_each(s.box, [&](const Index<Dim>& i) {
      Vec3 x = Vec3::Zero(), u = Vec3::Zero();
      for (int d = 0; d < Dim; ++d) x[d] = s.lattice.node_position(d, i[d]), u[d] = vectors(d, s.box.offset(i));
      sum += x.cross(u);
    });
    return sum;
  };
  project(s.piece, s.lattice, s.settings, density);
  const auto before = points();
  const Eigen::MatrixXd mass = nodal_sums(s.piece.nodes, N::mass, 1, s.box),
                        p = nodal_sums(s.piece.nodes, N::momentum, Dim, s.box), f = nodal_force(s.piece.nodes, s.box);
  EXPECT_LE((moment(p) - before.first).norm(), 1e-12 * before.first.norm());
  integrate(s.piece, dt);
  accelerate_and_project(s.piece, s.lattice, s.settings, density, dt);
  const auto after = points();
  const Eigen::MatrixXd again = nodal(s.piece.nodes, &NodeBox<Dim>::velocity, vector_width, 0, Dim, s.box);
  double work = 0;
  for (Eigen::Index i = 0; i < mass.cols(); ++i)
    if (mass(0, i) > 0) work += dt * f.col(i).dot(p.col(i) + again.col(i)) / (2 * mass(0, i));
  EXPECT_LE((after.first - before.first - dt * moment(f)).norm(), 1e-12 * before.first.norm());
  EXPECT_NEAR(after.second - before.second, work, 1e-12 * before.second);
}
TEST(Spin, KeepsAngularMomentumAndEnergy) {
  for_shapes<2>(check_spin_conservation<2>);
  for_shapes<3>(check_spin_conservation<3>);
}

/// The velocity at the nodes of a body that turns as a whole is that of the turning, also at its surface.
TEST(Spin, MakesRigidMotionExactAtEveryNode) {
  using N = NodeSums<3>;
  PieceSetup<3> s(ShapeFunction::gimp);
  const Vec3 w(0.3, -0.7, 0.5), about(1, 2, 3);
  for (int p = 0; p < point_count; ++p) {
    auto at = get_point(s.piece.points, p);
    at.v = w.cross(at.x - about), at.spin = w;
    put_point(s.piece.points, p, at);
  }
  project(s.piece, s.lattice, s.settings, density);
  const Eigen::MatrixXd mass = nodal_sums(s.piece.nodes, N::mass, 1, s.box),
                        p = nodal_sums(s.piece.nodes, N::momentum, 3, s.box);
  for_each(s.box, [&](const Index<3>& i) {
    Vec3 x;
    for (int d = 0; d < 3; ++d) x[d] = s.lattice.node_position(d, i[d]);
    const int node = s.box.offset(i);
    EXPECT_LE((p.col(node) - mass(0, node) * w.cross(x - about)).norm(), 1e-13 * mass.maxCoeff() * 5);
  });
}

}  // namespace
}  // namespace cairn
