// CPDI against its definition, corner by corner, and what has to hold whatever the points' domains are.

#include <gtest/gtest.h>

#include "../support/piece_setup.hpp"
#include "cairn/grid/cpdi.hpp"
#include "cairn/transfer/transfer.hpp"

namespace cairn {
namespace {

using namespace test;

/// A point's weight and gradient [1/m] at a node from the corners of its domain, R = half_size h F shortened to half a
/// cell along each direction.
template <int Dim>
std::pair<double, Vec<Dim>> weight_by_corners(const PieceSetup<Dim>& setup, const PointState<Dim>& at, double stretch,
                                              const std::type_identity_t<Index<Dim>>& node) {
  const auto& lattice = setup.lattice;
  Eigen::Matrix<double, Dim, Dim> R;
  for (int d = 0; d < Dim; ++d)
    for (int j = 0; j < Dim; ++j) R(d, j) = setup.settings.half_size[j] * lattice.spacing()[j] * at.F(d, j) / stretch;
  for (int d = 0; d < Dim; ++d) {
    const double reach = R.row(d).cwiseAbs().sum(), most = 0.5 * lattice.spacing()[d];
    if (reach > most) R.row(d) *= most / reach;
  }
  double value = 0;
  Vec<Dim> signed_sum = Vec<Dim>::Zero();
  for (int c = 0; c < 1 << Dim; ++c) {
    Vec<Dim> s;
    for (int j = 0; j < Dim; ++j) s[j] = c >> j & 1 ? 1 : -1;
    const Vec<Dim> corner = at.x + R * s;
    double w = 1;
    for (int d = 0; d < Dim; ++d)
      w *= std::max(0.0, 1 - std::abs(corner[d] - lattice.node_position(d, node[d])) / lattice.spacing()[d]);
    value += w / (1 << Dim), signed_sum += w / (1 << Dim) * s;
  }
  return {value, R.transpose().inverse() * signed_sum};
}

/// A random piece whose points are strained by up to `strain`.
template <int Dim>
PieceSetup<Dim> strained(double strain, double stretch = 1) {
  PieceSetup<Dim> setup(ShapeFunction::cpdi);
  if (stretch != 1) setup.settings.stretch = {stretch};
  for (int p = 0; p < point_count; ++p) {
    PointState<Dim> at = get_point(setup.piece.points, p);
    do at.F = Mat3::Identity() + random_matrix<Dim>(setup.random, strain);
    while (at.F.determinant() < 0.2);
    at.F *= stretch;
    put_point(setup.piece.points, p, at);
  }
  return setup;
}

template <int Dim>
void check_weights(double strain, double stretch) {
  auto setup = strained<Dim>(strain, stretch);
  freeze_domains(setup.piece, setup.lattice, setup.settings);
  const auto& points = setup.piece.points;
  const Spinning<CpdiShape> shape{{{}, setup.piece.domains.data(), domain_stride(points.size())}};
  for (int first = 0; first < points.size(); first += lane_count) {
    const double* x[Dim];
    for (int d = 0; d < Dim; ++d) x[d] = points.column(d) + first;
    const Stencil<Dim, Spinning<CpdiShape>> stencil(setup.lattice, shape, setup.piece.nodes.box, x, first);
    for (int lane = 0; lane < std::min(lane_count, points.size() - first); ++lane) {
      const PointState<Dim> at = get_point(points, first + lane);
      double sum = 0, spread[Dim] = {};
      Vec<Dim> mean = Vec<Dim>::Zero();
      Eigen::Matrix<double, Dim, Dim> gradient = Eigen::Matrix<double, Dim, Dim>::Zero();
      std::vector<NodeWeights<Dim>> found(setup.piece.nodes.box.size(), NodeWeights<Dim>{});
      stencil.for_weights(lane, [&](int node, const NodeWeights<Dim>& w) { found.at(node) = w; });
      for_each(setup.piece.nodes.box, [&](const std::type_identity_t<Index<Dim>>& node) {
        const auto& w = found[setup.piece.nodes.box.offset(node)];
        const auto [value, slope] = weight_by_corners(setup, at, stretch, node);
        double central = 1;
        for (int d = 0; d < Dim; ++d) {
          const double far = at.x[d] - setup.lattice.node_position(d, node[d]);
          central *= std::max(0.0, 1 - std::abs(far) / setup.lattice.spacing()[d]);
          EXPECT_NEAR(w.slope[d], slope[d], 1e-11 / setup.lattice.smallest_spacing());
          if (w.value != 0) {
            EXPECT_NEAR(w.arm[d], -far, 1e-13);
          }
          for (int e = 0; e < Dim; ++e) gradient(e, d) += w.slope[d] * setup.lattice.node_position(e, node[e]);
          mean[d] += w.value * setup.lattice.node_position(d, node[d]);
          spread[d] += w.value * far * far;
        }
        EXPECT_NEAR(w.value, value, 1e-13);
        EXPECT_NEAR(w.volume, 2.0 / 3 * central + value / 3, 1e-13);
        sum += w.value;
      });
      // Constant and linear fields, whatever the domain.
      EXPECT_NEAR(sum, 1, 1e-13);
      EXPECT_LE((mean - at.x).norm(), 1e-13);
      EXPECT_LE((gradient - Eigen::Matrix<double, Dim, Dim>::Identity()).norm(), 1e-11);
      for (int d = 0; d < Dim; ++d) EXPECT_NEAR(stencil.spread[d][lane], spread[d], 1e-13);
    }
  }
}
TEST(Cpdi, WeightsAreMeansOverCorners) {
  for (double stretch : {1.0, 0.93})
    for (double strain : {0.0, 0.15, 1.0}) {
      check_weights<2>(strain, stretch);
      check_weights<3>(strain, stretch);
    }
}

/// The nodes' power against the points' forces is the power of the stress, sum f . v = -sum V sigma : L, and forces are
/// in balance; with the domains of the projection, though F has changed since.
template <int Dim>
void check_power() {
  auto setup = strained<Dim>(0.4);
  auto& piece = setup.piece;
  setup.settings.gravity.setZero();
  project(piece, setup.lattice, setup.settings, density);
  const auto velocity = setup.set_random(&NodeBox<Dim>::velocity, vector_width, Dim);
  const auto force = nodal(piece.nodes, &NodeBox<Dim>::force, vector_width, 0, Dim, setup.box);
  double power = 0, largest = 0;
  for (int p = 0; p < point_count; ++p) {
    const PointState<Dim> at = get_point(piece.points, p);
    Mat3 L = Mat3::Zero();
    for_each(setup.box, [&](const Index<Dim>& node) {
      const auto slope = weight_by_corners(setup, at, 1, node).second;
      for (int d = 0; d < Dim; ++d)
        for (int e = 0; e < Dim; ++e) L(d, e) += velocity(d, setup.box.offset(node)) * slope[e];
    });
    const double part = at.volume() * (at.stress * L).trace();
    power += part, largest += std::abs(part);
  }
  EXPECT_NEAR((force.array() * velocity.array()).sum(), -power, 1e-12 * largest);
  EXPECT_LE(force.rowwise().sum().norm(), 1e-12 * force.norm());
  // F changes, the domains do not until the next projection: L is the same a second time.
  const Law law = make_law("neo_hookean", {{"shear_modulus", 1e4}, {"bulk_modulus", 2e4}});
  std::vector<Mat3> before;
  for (int p = 0; p < point_count; ++p) before.push_back(get_point(piece.points, p).F);
  SpeedLimits speeds;
  constexpr double dt = 1e-2;
  for (int step = 0; step < 2; ++step) update_stress(piece, setup.lattice, setup.settings, law, density, dt, speeds);
  for (int p = 0; p < point_count; ++p) {
    PointState<Dim> at = get_point(piece.points, p);
    const Mat3 after = at.F;
    at.F = before[p];
    Mat3 L = Mat3::Zero();
    for_each(setup.box, [&](const Index<Dim>& node) {
      const auto slope = weight_by_corners(setup, at, 1, node).second;
      for (int d = 0; d < Dim; ++d)
        for (int e = 0; e < Dim; ++e) L(d, e) += velocity(d, setup.box.offset(node)) * slope[e];
    });
    const Mat3 A = dt * L, step = Mat3::Identity() + A + 0.5 * A * A + 0.125 * A * A * A;  // as advance_deformation
    EXPECT_LE((after - step * step * before[p]).norm(), 1e-11 * after.norm());
  }
}
TEST(Cpdi, ForcesAreTheAdjointOfStrains) {
  check_power<2>();
  check_power<3>();
}

/// Momentum and angular momentum of points and of nodes.
template <int Dim>
void check_momentum() {
  auto setup = strained<Dim>(0.4);
  project(setup.piece, setup.lattice, setup.settings, density);
  const auto momentum =
      nodal(setup.piece.nodes, &NodeBox<Dim>::sums, NodeSums<Dim>::width, NodeSums<Dim>::momentum, Dim, setup.box);
  const auto inertia = spin_inertia(setup.piece, setup.lattice, setup.settings);
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  const auto padded = [](const Vec<Dim>& v) {
    Vec3 r = Vec3::Zero();
    for (int d = 0; d < Dim; ++d) r[d] = v[d];
    return r;
  };
  double scale = 0;
  for_each(setup.box, [&](const std::type_identity_t<Index<Dim>>& node) {
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) x[d] = setup.lattice.node_position(d, node[d]);
    const Vec3 p = padded(Vec<Dim>(momentum.col(setup.box.offset(node))));
    linear += p, angular += padded(x).cross(p), scale += p.norm();
  });
  for (int p = 0; p < point_count; ++p) {
    const PointState<Dim> at = get_point(setup.piece.points, p);
    linear -= density * at.volume0 * padded(at.v);
    angular -= density * at.volume0 * padded(at.x).cross(padded(at.v));
    // In 3D the inertia of a point is a tensor of which the diagonal is asked here: axes of the lattice.
    if (Dim == 2) angular[2] -= density * at.volume0 * inertia[p][0] * at.spin[2];
  }
  EXPECT_LE(linear.norm(), 1e-12 * scale);
  if (Dim == 2) {
    EXPECT_NEAR(angular[2], 0, 1e-12 * scale);
  }
}
TEST(Cpdi, ProjectionKeepsMomentum) {
  check_momentum<2>();
  check_momentum<3>();
}

}  // namespace
}  // namespace cairn
