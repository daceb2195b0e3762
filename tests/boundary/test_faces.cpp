// Faces of the domain: symmetry planes against the whole mirrored body, fixed faces, walls with friction.

#include <gtest/gtest.h>

#include "../support/node_patch.hpp"
#include "../support/pieces.hpp"
#include "cairn/boundary/faces.hpp"

namespace cairn {
namespace {

using namespace test;
using V = Vec<2>;

constexpr double density = 1300, dt = 1e-4;
constexpr int cells = 7;  // in each direction of the half
const ParameterValues elastic = {{"shear_modulus", 3e5}, {"bulk_modulus", 7e5}};
const std::vector<Body> one_body = {Body{}};

template <int Dim>
Lattice<Dim> block(double from, double to) {
  Index<Dim> n;
  n.fill(static_cast<int>(std::lround(to - from)));
  return Lattice<Dim>(Vec<Dim>::Constant(0.1 * from), Vec<Dim>::Constant(0.1 * to), n, {}, 100);
}

template <int Dim>
PointState<Dim> mirrored(PointState<Dim> at, int copy) {
  Mat3 Q = Mat3::Identity();
  for (int d = 0; d < Dim; ++d)
    if ((copy >> d) & 1) Q(d, d) = -1, at.x[d] *= -1, at.v[d] *= -1;
  at.spin = Q.determinant() * Q * at.spin;
  at.F = Q * at.F * Q, at.stress = Q * at.stress * Q;
  return at;
}

/// One patch with one piece, stepped through all transfers as the solver does.
template <int Dim>
struct Stepper {
  Lattice<Dim> lattice;
  FaceConditions<Dim> faces;
  TransferSettings<Dim> settings;
  Patch<Dim> patch;
  Law law = make_law("neo_hookean", elastic);

  Stepper(const Lattice<Dim>& lattice_, const SolverOptions& solver, const ContactOptions& contact)
      : lattice(lattice_), settings(TransferSettings<Dim>::make(solver, contact, Vec<Dim>::Zero())), patch(0, lattice) {
    patch.piece_of(0, 0);
  }
  Piece<Dim>& piece() { return patch.pieces[0]; }
  void project_points() {
    lay_out_nodes(piece(), lattice, settings);
    project(piece(), lattice, settings, density);
    mirror_sums(patch, lattice, faces);
  }
  void move_points() {
    SpeedLimits speeds;
    velocity_from_sums(piece());
    update_stress_and_force(piece(), lattice, settings, law, density, dt / 2, speeds);
    mirror_vectors(patch, lattice, faces, &NodeBox<Dim>::force);
    integrate(piece(), dt);
    accelerate_and_project(piece(), lattice, settings, density, dt);
    mirror_vectors(patch, lattice, faces, &NodeBox<Dim>::velocity);
    velocity_from_momentum(piece());
    update_stress_and_move(piece(), lattice, settings, law, density, dt / 2, dt, speeds);
  }
};

/// The part of a body inside symmetry planes (lower faces for side 0, upper ones for side 1) and the whole body.
template <int Dim>
struct Halves {
  static constexpr int points = 43, copies = 1 << Dim;
  int side;
  Stepper<Dim> half, whole;

  Halves(int side_, const SolverOptions& solver, const ContactOptions& contact)
      : side(side_),
        half(side == 0 ? block<Dim>(0, cells) : block<Dim>(-cells, 0), solver, contact),
        whole(block<Dim>(-cells, cells), solver, contact) {
    for (int d = 0; d < Dim; ++d) half.faces[2 * d + side].type = FaceType::symmetry;
    Random random(11);
    half.piece().points.resize(points);
    whole.piece().points.resize(points * copies);
    for (int p = 0; p < points; ++p) {
      Vec<Dim> x;
      for (int d = 0; d < Dim; ++d) x[d] = (side == 0 ? 0.1 : -0.1) * random(0, 3);
      const auto state = random_point<Dim>(random, x, 1e4);
      put_point(half.piece().points, p, state);
      for (int copy = 0; copy < copies; ++copy)
        put_point(whole.piece().points, copy * points + p, mirrored(state, copy));
    }
  }
  /// Largest difference of a nodal array over its largest value, on the half's nodes.
  double difference(AlignedDoubles NodeBox<Dim>::*array, int width, int first, int rows) {
    const auto& nodes = half.piece().nodes;
    Index<Dim> shift;
    shift.fill(side == 0 ? cells : 0);
    NodeBox<Dim> part = whole.piece().nodes;
    const Box<Dim> box = nodes.box;
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(box.size()));
    for_each(intersection(box.shifted(shift), part.box), [&](const Index<Dim>& i) {
      Index<Dim> here = i;
      for (int d = 0; d < Dim; ++d) here[d] -= shift[d];
      for (int r = 0; r < rows; ++r)
        expected(r, box.offset(here)) = (part.*array)[static_cast<std::size_t>(part.box.offset(i)) * width + first + r];
    });
    return relative_difference(nodal(nodes, array, width, first, rows, box), expected);
  }
};

template <int Dim>
void check_symmetry(int side, ShapeFunction shape, NormalSource normals) {
  using N = NodeSums<Dim>;
  using E = NodeExtras<Dim>;
  SCOPED_TRACE(testing::Message() << Dim << "D, side " << side << ", shape " << static_cast<int>(shape) << ", normals "
                                  << static_cast<int>(normals));
  SolverOptions solver;
  solver.shape = shape, solver.points_per_cell = 1 << Dim;
  ContactOptions contact;
  contact.normals = normals, contact.release = Release::traction;  // with the sums of stress and position
  Halves<Dim> body(side, solver, contact);
  for (int step = 0; step < 5; ++step) {
    body.half.project_points();
    body.whole.project_points();
    EXPECT_LE(body.difference(&NodeBox<Dim>::sums, N::width, N::mass, 1), 1e-12);
    EXPECT_LE(body.difference(&NodeBox<Dim>::sums, N::width, N::momentum, Dim), 1e-12);
    EXPECT_LE(body.difference(&NodeBox<Dim>::sums, N::width, N::volume, 1), 1e-12);
    EXPECT_LE(body.difference(&NodeBox<Dim>::sums, N::width, N::gradient, Dim), 1e-12);
    EXPECT_LE(body.difference(&NodeBox<Dim>::force, vector_width, 0, Dim), 1e-12);
    EXPECT_LE(body.difference(&NodeBox<Dim>::extras, E::width, 0, E::used), 1e-12);
    body.half.move_points();
    body.whole.move_points();
    for (int p = 0; p < body.points; ++p) {
      const auto a = get_point(body.half.piece().points, p), b = get_point(body.whole.piece().points, p);
      EXPECT_LE((a.x - b.x).norm(), 1e-13);
      EXPECT_LE((a.v - b.v).norm(), 1e-10);
      EXPECT_LE((a.F - b.F).norm(), 1e-12);
      EXPECT_LE((a.stress - b.stress).norm(), 1e-7);
    }
  }
}
TEST(SymmetryPlane, HalfABodyMovesLikeTheWhole) {
  for (int side : {0, 1})
    for (ShapeFunction shape :
         {ShapeFunction::linear, ShapeFunction::gimp, ShapeFunction::bspline2, ShapeFunction::cpdi})
      for (NormalSource normals : {NormalSource::volume_gradient, NormalSource::density}) {
        check_symmetry<2>(side, shape, normals);
        check_symmetry<3>(side, shape, normals);
      }
}

// Fixed faces ---------------------------------------------------------------------------------------------------------

/// A piece whose points reach half a cell beyond the left face, with sums, forces and motion; the left face is fixed.
struct FixedFace {
  Stepper<2> stepper{block<2>(0, cells), SolverOptions{}, ContactOptions{}};
  V face_velocity{3, -2};
  FixedFace() {
    Random random(5);
    stepper.patch.pieces[0] = random_piece<2>(random, stepper.lattice, 50, V(-0.4, 1), V(4, 5));
    stepper.faces[0].type = FaceType::fixed, stepper.faces[0].velocity = face_velocity;
    stepper.project_points();
    velocity_from_sums(stepper.piece());
    integrate(stepper.piece(), dt);
  }
  /// Calls f(node's place, offset) for nodes with mass.
  template <class F>
  void for_nodes(F&& f) {
    const auto& nodes = stepper.piece().nodes;
    for_each(nodes.box, [&](const Index<2>& i) {
      if (nodes.sums[nodes.box.offset(i) * NodeSums<2>::width] > 0) f(i, nodes.box.offset(i));
    });
  }
  V velocity(const AlignedDoubles& from, int node) const { return {from[4 * node], from[4 * node + 1]}; }
  V moved(const AlignedDoubles& from, int node) const { return {from[4 * node + 2], from[4 * node + 3]}; }
};

TEST(FixedFace, SetsVelocitiesOnItAndBeyond) {
  FixedFace f;
  const auto before = f.stepper.piece().nodes.velocity;
  constrain_velocity(f.stepper.patch, f.stepper.lattice, f.stepper.faces, one_body, false);
  int on_face = 0;
  f.for_nodes([&](const Index<2>& i, int node) {
    const V v = f.velocity(f.stepper.piece().nodes.velocity, node);
    EXPECT_EQ(v, i[0] <= 0 ? f.face_velocity : f.velocity(before, node)) << i[0] << " " << i[1];
    on_face += i[0] <= 0;
  });
  EXPECT_GT(on_face, 8);
}

TEST(FixedFace, AcceleratesToItsVelocityAndBooksTheWork) {
  FixedFace f;
  const auto before = f.stepper.piece().nodes;
  constrain_motion(f.stepper.patch, f.stepper.lattice, f.stepper.faces, one_body, dt, false);
  double work = 0;
  f.for_nodes([&](const Index<2>& i, int node) {
    const V v = f.moved(f.stepper.piece().nodes.motion, node), a = f.velocity(f.stepper.piece().nodes.motion, node);
    const V free = f.moved(before.motion, node), start = f.velocity(before.velocity, node);
    if (i[0] > 0) {
      EXPECT_EQ(v, free);
      EXPECT_EQ(a, f.velocity(before.motion, node));
      return;
    }
    EXPECT_EQ(v, f.face_velocity);
    EXPECT_LE((start + dt * a - f.face_velocity).norm(), 1e-12);
    work += before.sums[node * NodeSums<2>::width] * (f.face_velocity - free).dot(f.face_velocity);
  });
  EXPECT_NEAR(f.stepper.patch.ledger.boundary_work, work, 1e-12 * std::abs(work));
}

TEST(FixedFace, LedgerClosesOverTheStep) {
  // The face's impulse is v_face m - p - f dt. Work less loss is what the points gain, change . (v + v')/2 with v'
  // projected again, less f dt . v_face, which the strains at the face's velocity take.
  FixedFace f;
  constrain_motion(f.stepper.patch, f.stepper.lattice, f.stepper.faces, one_body, dt, false);
  auto& nodes = f.stepper.piece().nodes;
  for (double& v : nodes.velocity) v += 0.25;  // what comes back from the points
  const auto again = nodes.velocity;
  double gained = 0;
  f.for_nodes([&](const Index<2>& i, int node) {
    if (i[0] > 0) return;
    const double* sums = nodes.sums.data() + node * NodeSums<2>::width;
    const V p(sums[NodeSums<2>::momentum], sums[NodeSums<2>::momentum + 1]);
    gained += (sums[0] * f.face_velocity - p).dot(0.5 * (p / sums[0] + f.velocity(again, node)));
    gained -= dt * f.velocity(nodes.force, node).dot(f.face_velocity);
  });
  constrain_velocity(f.stepper.patch, f.stepper.lattice, f.stepper.faces, one_body, true);
  const auto& ledger = f.stepper.patch.ledger;
  EXPECT_NEAR(ledger.boundary_work - ledger.contact_dissipation, gained, 1e-12 * std::abs(ledger.boundary_work));
}

TEST(FixedFace, LeavesRigidBodiesAlone) {
  FixedFace f;
  const auto before = f.stepper.piece().nodes;
  Body rigid;
  rigid.rigid = true;
  constrain_velocity(f.stepper.patch, f.stepper.lattice, f.stepper.faces, {rigid}, true);
  constrain_motion(f.stepper.patch, f.stepper.lattice, f.stepper.faces, {rigid}, dt, true);
  EXPECT_EQ(f.stepper.piece().nodes.velocity, before.velocity);
  EXPECT_EQ(f.stepper.piece().nodes.motion, before.motion);
  EXPECT_EQ(f.stepper.patch.ledger.boundary_work, 0);
}

// Walls ---------------------------------------------------------------------------------------------------------------

/// One body at a node of the left wall (not in a corner of two walls).
struct WallNode {
  NodePatch<2> node;
  ContactSettings<2> settings;

  WallNode(const NodeBody<2>& body, double mu, Release release = Release::reaction, V velocity = V(0, 0),
           ContactLaw law = ContactLaw::friction, int side = 0, GapRule gap = GapRule::pressure)
      : node({body}, side == 0 ? 0 : 8) {
    FaceConditions<2> faces;
    faces[side].type = FaceType::wall, faces[side].velocity = velocity, faces[side].friction = {{law, mu}};
    ContactOptions options;
    options.release = release, options.gap = gap;
    settings = node.settings(options, 1, faces);
  }
  void first() { node.first(settings); }
  void second() { node.second(settings); }
  void repeat() { node.repeat(settings); }
};

NodeBody<2> sliding(V momentum, V force = V(0, 0)) {
  NodeBody<2> body;
  body.mass = 2, body.momentum = momentum, body.force = force;
  body.gradient = V(-1, 0);  // it lies above the lower wall
  return body;
}

void expect_vector(const V& found, const V& expected) {
  EXPECT_LE((found - expected).norm(), 1e-12) << found.transpose();
}

TEST(Wall, SlidingBlockIsBrakedByMuTimesItsWeight) {
  // Sliding along the wall at 5 and pressed on it by 100 N: friction takes 0.3 x 100 N.
  WallNode w(sliding(V(0, 5), V(-100, 0)), 0.3);
  w.first();
  expect_vector(w.node.momentum(0), V(0, 5));
  w.second();
  expect_vector(w.node.force(0), V(0, -30));
  w.node.project_updated();
  w.repeat();
  // Dissipation: friction force times the mean velocity, (5 + 4.7)/2/m.
  EXPECT_NEAR(w.node.patch.ledger.contact_dissipation, 0.3 * (5 + 4.7) / 2 / 2, 1e-13);
  EXPECT_EQ(w.node.patch.ledger.contact_nodes, 1);
}

TEST(Wall, BlockAtRestSticksUpToMu) {
  for (double pull : {29.0, 31.0}) {
    WallNode w(sliding(V(0, 0), V(-100, pull)), 0.3);
    w.first();
    w.second();
    expect_vector(w.node.force(0), V(0, std::max(0.0, pull - 30)));
  }
}

TEST(Wall, ApproachReleaseWorkedByHand) {
  WallNode w(sliding(V(-3, 4)), 0.3, Release::approach);
  w.first();
  expect_vector(w.node.momentum(0), V(0, 3.1));
  WallNode away(sliding(V(3, 4)), 0.3, Release::approach);
  away.first();
  expect_vector(away.node.momentum(0), V(3, 4));
}

TEST(Wall, MovingWallCarriesAlong) {
  // A wall at (1, 2) m/s: momentum of the body on it (2, 4).
  WallNode w(sliding(V(-3, 4)), std::numeric_limits<double>::infinity(), Release::approach, V(1, 2));
  w.first();
  expect_vector(w.node.momentum(0), V(2, 4));
  WallNode second(sliding(V(-3, 4)), 0, Release::approach, V(1, 2));
  second.second();  // nothing found yet: nothing done
  expect_vector(second.node.force(0), V(0, 0));
  second.settings.options.passes = Passes::after;
  second.first();
  second.second();
  expect_vector(second.node.updated(0), V(2, 4));
  second.node.project_updated();
  second.repeat();
  EXPECT_NEAR(second.node.patch.ledger.boundary_work, 5 * 1, 1e-12);  // impulse (5, 0) times the wall's velocity
  // Work in, less what is lost, is the change of kinetic energy.
  const auto& ledger = second.node.patch.ledger;
  EXPECT_NEAR(ledger.boundary_work - ledger.contact_dissipation, (V(2, 4).squaredNorm() - V(-3, 4).squaredNorm()) / 4,
              1e-12);
}

TEST(Wall, UpperWallFacesTheOtherWay) {
  WallNode w(sliding(V(3, 4)), 0.3, Release::approach, V(0, 0), ContactLaw::friction, 1);
  w.first();
  expect_vector(w.node.momentum(0), V(0, 3.1));
}

TEST(Wall, StickTakesTheWallsVelocity) {
  WallNode w(sliding(V(3, 4)), 0, Release::reaction, V(0.5, 0), ContactLaw::stick);
  w.first();
  expect_vector(w.node.momentum(0), V(1, 0));
  w.second();
  expect_vector(w.node.updated(0), V(1, 0));
  w.repeat();
  expect_vector(w.node.projected(0), V(1, 0));
}

/// A layer 0.11 cells off the wall, that comes to it at 1.5 m/s and is pressed by a force.
WallNode layer_near_wall(double volume, double force, GapRule gap) {
  auto body = sliding(V(-3, 4), V(force, 0));
  body.volume = volume;  // with a gradient of 1
  WallNode w(body, 0.3, Release::reaction, V(0, 0), ContactLaw::friction, 0, gap);
  w.first();
  return w;
}

TEST(Wall, StandOffHoldsOnlyWhatTouches) {
  WallNode apart = layer_near_wall(0.39, -100, GapRule::fill);  // 0.106 cells is the largest gap
  apart.second();
  expect_vector(apart.node.momentum(0), V(-3, 4));
  expect_vector(apart.node.force(0), V(-100, 0));
  WallNode near = layer_near_wall(0.41, -100, GapRule::fill);
  expect_vector(near.node.momentum(0), V(0, 4));
  near.repeat();
  expect_vector(near.node.projected(0), V(0, 4));
}

TEST(Wall, PressureMakesWhatIsApartTouch) {
  // A unit of force allows 16 h / (2 c^2 m) = 16 / (2 x 900 x 2) cells.
  const double closing = 0.11 / (16.0 / 3600);
  for (double share : {0.99, 1.01}) {
    const WallNode w = layer_near_wall(0.39, -share * closing, GapRule::pressure);
    expect_vector(w.node.momentum(0), share < 1 ? V(-3, 4) : V(0, 4));
  }
  expect_vector(layer_near_wall(0.485, -1e-3, GapRule::pressure).node.momentum(0),
                V(0, 4));                                                                    // 0.015 cells: in any case
  expect_vector(layer_near_wall(0.26, -1e6, GapRule::pressure).node.momentum(0), V(-3, 4));  // 0.24 cells: never
}

TEST(Wall, WhatLiesBeyondTouches) {
  auto body = sliding(V(-3, 4));
  body.volume = 0.1, body.gradient = V(0.4, 0);  // points back into the domain
  WallNode w(body, 0.3);
  w.first();
  expect_vector(w.node.momentum(0), V(0, 4));
}

/// A node beyond a wall takes the gap of the node on it and decides by its own motion and force.
TEST(Wall, NodesBeyondDecideForThemselves) {
  for (double beyond : {-7.0, 7.0})
    for (double volume : {0.5, 0.2}) {  // of the body at the node on the wall: it touches, or does not
      auto body = sliding(V(0, 5), V(100, 0));
      body.volume = volume;
      WallNode w(body, 0.3);
      auto& nodes = w.node.patch.pieces[0].nodes;
      NodeBox<2> wide = nodes;
      wide.box.lower[0] = -1;
      for (auto array : {&NodeBox<2>::sums, &NodeBox<2>::force, &NodeBox<2>::velocity, &NodeBox<2>::extras}) {
        AlignedDoubles twice = nodes.*array;
        twice.insert(twice.end(), (nodes.*array).begin(), (nodes.*array).end());
        wide.*array = twice;
      }
      wide.force[0] = beyond;
      nodes = wide;
      w.first();
      w.second();
      const bool held = beyond < 0 && volume == 0.5;
      EXPECT_NEAR(nodes.force[0], held ? 0 : beyond, 1e-12);
      EXPECT_NEAR(nodes.force[1], held ? -0.3 * 7 : 0, 1e-12);
      EXPECT_EQ(nodes.force[vector_width], 100);  // pulled off
    }
}

}  // namespace
}  // namespace cairn
