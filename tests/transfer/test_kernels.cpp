// Transfers between points and nodes against loops over all points and all nodes, with weights written a second time.

#include <gtest/gtest.h>

#include "../support/piece_setup.hpp"

namespace cairn {
namespace {

using namespace test;

template <int Dim>
void check_projection(ShapeFunction kind, NormalSource source) {
  using N = NodeSums<Dim>;
  SCOPED_TRACE(testing::Message() << Dim << "D, shape " << static_cast<int>(kind) << ", normals "
                                  << static_cast<int>(source));
  PieceSetup<Dim> s(kind, source, true);
  project(s.piece, s.lattice, s.settings, density);
  const auto naive = s.naive();
  const auto& nodes = s.piece.nodes;
  EXPECT_LE(relative_difference(nodal_sums(nodes, N::mass, 1, s.box), naive.mass), round_off);
  EXPECT_LE(relative_difference(nodal_sums(nodes, N::momentum, Dim, s.box), naive.momentum), round_off);
  EXPECT_LE(relative_difference(nodal_sums(nodes, N::volume, 1, s.box), naive.volume), round_off);
  EXPECT_LE(relative_difference(nodal_sums(nodes, N::gradient, Dim, s.box),
                                source == NormalSource::volume_gradient ? naive.volume_gradient : naive.mass_gradient),
            round_off);
  EXPECT_LE(relative_difference(nodal_force(nodes, s.box), naive.force), round_off);

  using E = NodeExtras<Dim>;
  const auto extras = [&](int first, int rows) {
    return nodal(nodes, &NodeBox<Dim>::extras, E::width, first, rows, s.box);
  };
  EXPECT_LE(relative_difference(extras(E::position, Dim), naive.position), round_off);
  const std::vector<int> components =
      Dim == 2 ? std::vector{0, 4, 1} : std::vector{0, 4, 8, 1, 5, 2};  // in a 3x3 matrix
  for (std::size_t i = 0; i < components.size(); ++i)
    EXPECT_LE(relative_difference(extras(E::stress + static_cast<int>(i), 1), naive.stress.row(components[i])),
              round_off);
}
TEST(Project, MatchesLoopsOverAllPointsAndNodes) {
  for (ShapeFunction kind : {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline2})
    for (NormalSource source : {NormalSource::volume_gradient, NormalSource::mass_gradient, NormalSource::density}) {
      check_projection<2>(kind, source);
      check_projection<3>(kind, source);
    }
}

template <int Dim>
void check_conservation(PieceSetup<Dim>& s) {
  using N = NodeSums<Dim>;
  project(s.piece, s.lattice, s.settings, density);
  double mass = 0, volume = 0;
  Vec<Dim> momentum = Vec<Dim>::Zero();
  for (int p = 0; p < point_count; ++p) {
    const auto at = get_point(s.piece.points, p);
    mass += density * at.volume0, volume += at.volume(), momentum += density * at.volume0 * at.v;
  }
  const auto& nodes = s.piece.nodes;
  EXPECT_NEAR(total_size(nodal_sums(nodes, N::mass, 1, s.box)), mass, round_off * mass);
  EXPECT_NEAR(total_size(nodal_sums(nodes, N::volume, 1, s.box)), volume, round_off * volume);
  EXPECT_LE((total<Dim>(nodal_sums(nodes, N::momentum, Dim, s.box)) - momentum).norm(), round_off * mass);
  const Eigen::MatrixXd gradient = nodal_sums(nodes, N::gradient, Dim, s.box), force = nodal_force(nodes, s.box);
  EXPECT_LE(total<Dim>(gradient).norm(), round_off * total_size(gradient));
  EXPECT_LE((total<Dim>(force) - mass * s.settings.gravity).norm(), round_off * total_size(force));
}
TEST(Project, ConservesMassMomentumAndForce) {
  for_shapes<2>(check_conservation<2>);
  for_shapes<3>(check_conservation<3>);
}

/// The internal force turns nothing: sum x_i x f_i = 0 for a symmetric stress (linear reproduction).
template <int Dim>
void check_torque(PieceSetup<Dim>& s) {
  s.settings.gravity.setZero();
  project(s.piece, s.lattice, s.settings, density);
  Mat3 moment = Mat3::Zero();
  const Eigen::MatrixXd force = nodal_force(s.piece.nodes, s.box);
  for_each(s.box, [&](const Index<Dim>& i) {
    for (int d = 0; d < Dim; ++d)
      for (int e = 0; e < Dim; ++e) moment(d, e) += i[d] * s.lattice.spacing()[d] * force(e, s.box.offset(i));
  });
  EXPECT_LE(skew_part(moment).norm(), 1e-12 * moment.norm());
}
TEST(Project, InternalForcesTurnNothing) {
  for_shapes<2>(check_torque<2>);
  for_shapes<3>(check_torque<3>);
}

TEST(Project, OutwardGradientPointsOut) {
  // A block of points: on its left side the gradient points left.
  for (NormalSource source : {NormalSource::volume_gradient, NormalSource::mass_gradient, NormalSource::density}) {
    PieceSetup<2> s(ShapeFunction::gimp, source);
    s.piece = random_piece<2>(s.random, s.lattice, 400, Vec<2>(2, 0), Vec<2>(4, 5));
    lay_out_nodes(s.piece, s.lattice, s.settings);
    project(s.piece, s.lattice, s.settings, density);
    const auto gradient = nodal_sums(s.piece.nodes, NodeSums<2>::gradient, 2, s.box);
    EXPECT_LT(gradient(0, s.box.offset({2, 2})), 0);
    EXPECT_GT(gradient(0, s.box.offset({4, 2})), 0);
  }
}

TEST(Project, EmptyPieceHasNoNodes) {
  PieceSetup<3> s(ShapeFunction::gimp);
  s.piece = Piece<3>(0, 0);
  lay_out_nodes(s.piece, s.lattice, s.settings);
  EXPECT_TRUE(s.piece.nodes.box.empty());
  project(s.piece, s.lattice, s.settings, density);
  EXPECT_TRUE(s.piece.nodes.sums.empty());
}

const ParameterValues elastic = {{"shear_modulus", 3e5}, {"bulk_modulus", 7e5}};

/// What a step with A = dt L multiplies the deformation gradient by.
Mat3 increment_of(const Mat3& A) { return Mat3::Identity() + A + A * A / 2 + A * A * A / 8; }

/// Deformation, stress and the force of the new stress after a strain step, point by point.
template <int Dim>
void check_stress(PieceSetup<Dim>& s, bool with_force) {
  const double dt = 0.01;
  const Law law = make_law("neo_hookean", elastic);
  project(s.piece, s.lattice, s.settings, density);
  const Eigen::MatrixXd velocity = s.set_random(&NodeBox<Dim>::velocity, vector_width, Dim);
  const Eigen::MatrixXd motion = s.set_random(&NodeBox<Dim>::motion, NodeMotion<Dim>::width, 2 * Dim);
  std::vector<PointState<Dim>> expected;
  double fastest = 0, fastest_point = 0;
  for (int p = 0; p < point_count; ++p) {
    auto at = get_point(s.piece.points, p);
    const Mat3 A = dt * s.velocity_gradient(velocity, at.x);
    at.F = increment_of(A) * at.F;
    Symmetric<Dim, double> stress{};
    double* none = nullptr;
    const double modulus =
        std::get<NeoHookean>(law).update(tensor<Dim>(A), tensor<Dim>(at.F), at.F.determinant(), stress, none);
    fastest = std::max(fastest, std::sqrt(modulus / density));
    at.stress = matrix(stress);
    if (!with_force)
      at.x += 3 * dt * s.interpolate(motion, Dim, at.x), fastest_point = std::max(fastest_point, at.v.norm());
    expected.push_back(at);
  }
  SpeedLimits speeds;
  if (with_force)
    update_stress_and_force(s.piece, s.lattice, s.settings, law, density, dt, speeds);
  else
    update_stress_and_move(s.piece, s.lattice, s.settings, law, density, dt, 3 * dt, speeds);
  EXPECT_NEAR(speeds.wave, fastest, round_off * fastest);
  EXPECT_NEAR(speeds.point, fastest_point, round_off * fastest_point);
  for (int p = 0; p < point_count; ++p) {
    const auto at = get_point(s.piece.points, p);
    EXPECT_LE((at.F - expected[p].F).norm(), round_off * 10);
    EXPECT_LE((at.stress - expected[p].stress).norm(), 1e-12 * 7e5);
    EXPECT_LE((at.x - expected[p].x).norm(), 10 * round_off);
    EXPECT_EQ(at.v, expected[p].v);
  }
  if (with_force) {
    EXPECT_LE(relative_difference(nodal_force(s.piece.nodes, s.box), s.naive().force), round_off);
  }
}
TEST(UpdateStressAndMove, MatchesLoops) {
  for_shapes<2>([](auto& s) { check_stress(s, false); });
  for_shapes<3>([](auto& s) { check_stress(s, false); });
}
TEST(UpdateStressAndForce, MatchesLoops) {
  for_shapes<2>([](auto& s) { check_stress(s, true); });
  for_shapes<3>([](auto& s) { check_stress(s, true); });
}

TEST(UpdateStressAndMove, KeepsALargerSpeedSeenBefore) {
  PieceSetup<2> s(ShapeFunction::gimp);
  s.set_random(&NodeBox<2>::velocity, vector_width, 2);
  SpeedLimits speeds{1e6, 3};
  s.set_random(&NodeBox<2>::motion, NodeMotion<2>::width, 4);
  update_stress_and_move(s.piece, s.lattice, s.settings, make_law("neo_hookean", elastic), density, 1e-3, 0, speeds);
  EXPECT_NEAR(speeds.wave, 1e6, 1e-6);
  EXPECT_NEAR(speeds.point, 3, 1e-15);
}

/// The law's own variables of every point, also of those in the last, incomplete chunk.
TEST(UpdateStressAndMove, UpdatesTheStateOfEveryPoint) {
  PieceSetup<3> s(ShapeFunction::gimp);
  s.piece = random_piece<3>(s.random, s.lattice, 13, Vec<3>::Constant(1), Vec<3>::Constant(4), 0, 1);
  lay_out_nodes(s.piece, s.lattice, s.settings);
  const Eigen::MatrixXd velocity = s.set_random(&NodeBox<3>::velocity, vector_width, 3);
  const Law law = make_law("hypoelastic", elastic);
  std::vector<double> expected;
  for (int p = 0; p < 13; ++p) {
    const auto at = get_point(s.piece.points, p);
    const Mat3 A = 0.01 * s.velocity_gradient(velocity, at.x), F = increment_of(A) * at.F;
    auto stress = symmetric<3>(at.stress);
    double state = 0;
    std::get<Hypoelastic>(law).update(tensor<3>(A), tensor<3>(F), F.determinant(), stress, &state);
    expected.push_back(state);
  }
  SpeedLimits speeds;
  s.set_random(&NodeBox<3>::motion, NodeMotion<3>::width, 6);
  update_stress_and_move(s.piece, s.lattice, s.settings, law, density, 0.01, 0, speeds);
  for (int p = 0; p < 13; ++p)
    EXPECT_NEAR(s.piece.points.column(PointColumns<3>::state)[p], expected[p], 1e-11 * std::abs(expected[p]));
}

/// Kinetic energies of a piece's points, of velocities and of spins [J].
template <int Dim>
Eigen::Vector2d kinetic_energies(const Piece<Dim>& piece, const PieceSetup<Dim>& s) {
  const auto inertia = spin_inertia(piece, s.lattice, s.settings);
  Eigen::Vector2d sum(0, 0);
  for (int p = 0; p < point_count; ++p) {
    const auto at = get_point(piece.points, p);
    double spin = 0;
    for (int i = 0; i < spin_size<Dim>; ++i)
      spin += inertia[p][i] * std::pow(piece.points.column(PointColumns<Dim>::spin + i)[p], 2);
    sum += 0.5 * density * at.volume0 * Eigen::Vector2d(at.v.squaredNorm(), spin);
  }
  return sum;
}

/// Told are: what blending takes from velocities, which is the difference to an update without, and what the nodes give
/// to the spins, which they keep in an update without relaxation.
template <int Dim>
void check_energy_told(PieceSetup<Dim>& s) {
  const double dt = 0.03;
  s.set_random(&NodeBox<Dim>::motion, NodeMotion<Dim>::width, 2 * Dim);
  Piece<Dim> free = s.piece;
  const auto before = kinetic_energies(s.piece, s);
  s.settings.flip = 0.9;
  const double told = accelerate(s.piece, s.lattice, s.settings, density, dt);
  s.settings.flip = 1, s.settings.spin_relaxation = 0;
  const double given = accelerate(free, s.lattice, s.settings, density, dt);
  const auto kept = kinetic_energies(free, s), after = kinetic_energies(s.piece, s);
  const double size = kept.sum();
  EXPECT_NEAR(given, kept[1] - before[1], 1e-13 * size);
  EXPECT_GT(std::abs(kept[0] - after[0]), 1e-3 * size);
  EXPECT_NEAR(told, kept[0] - after[0] + given, 1e-12 * size);
}
TEST(Accelerate, TellsEnergies) {
  for_shapes<2>(check_energy_told<2>);
  for_shapes<3>(check_energy_told<3>);
}

template <int Dim>
void check_motion(PieceSetup<Dim>& s) {
  const double dt = 0.03;
  const Eigen::MatrixXd motion = s.set_random(&NodeBox<Dim>::motion, NodeMotion<Dim>::width, 2 * Dim);
  for (double flip : {1.0, 0.9, 0.0}) {
    s.settings.flip = flip;
    std::vector<PointState<Dim>> before;
    for (int p = 0; p < point_count; ++p) before.push_back(get_point(s.piece.points, p));
    accelerate(s.piece, s.lattice, s.settings, density, dt);
    for (int p = 0; p < point_count; ++p) {
      const Vec<Dim> a = s.interpolate(motion, 0, before[p].x), u = s.interpolate(motion, Dim, before[p].x);
      const Vec<Dim> v = flip * (before[p].v + dt * a) + (1 - flip) * u;
      EXPECT_LE((get_point(s.piece.points, p).v - v).norm(), 10 * round_off);
      const Vec3 spin = s.settings.spin ? s.spin(motion, before[p], dt, flip) : before[p].spin;
      EXPECT_LE((get_point(s.piece.points, p).spin - spin).norm(), 1e3 * round_off);
    }
  }
  std::vector<PointState<Dim>> before;
  double fastest = 0;
  for (int p = 0; p < point_count; ++p) before.push_back(get_point(s.piece.points, p));
  Piece<Dim> alone = s.piece;
  accelerate(alone, s.lattice, s.settings, density, dt);
  SpeedLimits speeds;
  accelerate_and_move(s.piece, s.lattice, s.settings, density, dt, speeds);
  for (int p = 0; p < point_count; ++p) {
    const auto at = get_point(s.piece.points, p), expected = get_point(alone.points, p);
    EXPECT_LE((at.x - before[p].x - dt * s.interpolate(motion, Dim, before[p].x)).norm(), 10 * round_off);
    EXPECT_LE((at.v - expected.v).norm(), round_off);
    EXPECT_LE((at.spin - expected.spin).norm(), 1e3 * round_off);
    fastest = std::max(fastest, at.v.norm());
  }
  EXPECT_NEAR(speeds.point, fastest, round_off * fastest);
}
TEST(AccelerateAndMove, MatchLoops) {
  for_shapes<2>(check_motion<2>);
  for_shapes<3>(check_motion<3>);
}

template <int Dim>
void check_momentum(PieceSetup<Dim>& s) {
  const double dt = 0.03;
  s.settings.flip = 0.8;
  s.set_random(&NodeBox<Dim>::motion, NodeMotion<Dim>::width, 2 * Dim);
  const auto momentum = [&](const Piece<Dim>& piece) {
    return nodal(piece.nodes, &NodeBox<Dim>::velocity, vector_width, 0, Dim, s.box);
  };
  project_momentum(s.piece, s.lattice, s.settings, density);
  EXPECT_LE(relative_difference(momentum(s.piece), s.naive().momentum), round_off);

  Piece<Dim> at_once = s.piece;
  accelerate(s.piece, s.lattice, s.settings, density, dt);
  EXPECT_GT(relative_difference(momentum(s.piece), s.naive().momentum), round_off);  // not projected again yet
  project_momentum(s.piece, s.lattice, s.settings, density);
  EXPECT_LE(relative_difference(momentum(s.piece), s.naive().momentum), round_off);
  accelerate_and_project(at_once, s.lattice, s.settings, density, dt);
  EXPECT_LE(relative_difference(momentum(at_once), momentum(s.piece)), round_off);
  for (int p = 0; p < point_count; ++p)
    EXPECT_LE((get_point(at_once.points, p).v - get_point(s.piece.points, p).v).norm(), round_off);
}
TEST(ProjectMomentum, MatchesLoopsAloneAndWithAcceleration) {
  for_shapes<2>(check_momentum<2>);
  for_shapes<3>(check_momentum<3>);
}

template <int Dim>
void check_integration(PieceSetup<Dim>& s) {
  using N = NodeSums<Dim>;
  const double dt = 0.02;
  project(s.piece, s.lattice, s.settings, density);
  auto& nodes = s.piece.nodes;
  // A node that the box holds and no point reaches has no velocity.
  std::fill_n(nodes.sums.begin(), N::width, 0.0);
  std::fill_n(nodes.force.begin(), vector_width, 0.0);
  integrate(s.piece, dt);
  velocity_from_sums(s.piece);
  const AlignedDoubles from_sums = nodes.velocity;
  velocity_from_motion(s.piece);
  const AlignedDoubles from_motion = nodes.velocity;
  for (std::size_t i = 0; i < nodes.box.size(); ++i) {
    const double mass = nodes.sums[i * N::width + N::mass];
    for (int d = 0; d < Dim; ++d) {
      const double p = nodes.sums[i * N::width + N::momentum + d], f = nodes.force[i * vector_width + d];
      const double a = mass > 0 ? f / mass : 0, v = mass > 0 ? p / mass : 0;
      EXPECT_NEAR(nodes.motion[i * NodeMotion<Dim>::width + d], a, round_off * std::abs(a));
      EXPECT_NEAR(nodes.motion[i * NodeMotion<Dim>::width + Dim + d], v + dt * a,
                  round_off * (std::abs(v) + dt * std::abs(a)));
      EXPECT_NEAR(from_sums[i * vector_width + d], v, round_off * std::abs(v));
      EXPECT_EQ(from_motion[i * vector_width + d], nodes.motion[i * NodeMotion<Dim>::width + Dim + d]);
    }
  }
  project_momentum(s.piece, s.lattice, s.settings, density);
  velocity_from_momentum(s.piece);
  for (std::size_t i = 1; i < nodes.box.size(); ++i)
    for (int d = 0; d < Dim; ++d)
      EXPECT_NEAR(nodes.velocity[i * vector_width + d], from_sums[i * vector_width + d],
                  1e-12 * (1 + std::abs(from_sums[i * vector_width + d])));
}
TEST(Integrate, FollowsItsEquations) {
  for_shapes<2>(check_integration<2>);
  for_shapes<3>(check_integration<3>);
}

}  // namespace
}  // namespace cairn
