// The whole step: conservation laws, rigid motions and sticking contact, whose results are known exactly.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double forever = 1e300;
constexpr StressUpdate all_updates[] = {StressUpdate::last, StressUpdate::first, StressUpdate::both,
                                        StressUpdate::modified_last};

/// Momentum of one body.
template <int Dim>
Vec<Dim> momentum_of(const Simulation<Dim>& simulation, int body) {
  Vec<Dim> sum = Vec<Dim>::Zero();
  for (const auto& [id, point] : points_of(simulation))
    if (point.body == body) sum += point.mass * point.v;
  return sum;
}

// Collisions ----------------------------------------------------------------------------------------------------------

template <int Dim>
void check_momentum(const Case& c, int steps) {
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const Totals start = simulation.totals();
  const Vec<Dim> first_body = momentum_of(simulation, 0);
  const double one_body = first_body.norm();
  for (int i = 0; i < steps; ++i) {
    simulation.step(forever);
    if (i % 20 != 0 && i != steps - 1) continue;
    const Totals now = simulation.totals();
    ASSERT_LE((now.momentum - start.momentum).norm(), 1e-12 * one_body) << "step " << i;
    ASSERT_NEAR(now.mass, start.mass, 1e-13 * start.mass);  // the sum's order changes, its terms do not
  }
  EXPECT_GT((momentum_of(simulation, 0) - first_body).norm(), 0.1 * one_body) << "the bodies did not meet";
}

TEST(Conservation, MomentumInAnObliqueCollisionWithFriction) {
  for (Release release : {Release::reaction, Release::approach, Release::traction})
    for (ShapeFunction shape : {ShapeFunction::gimp, ShapeFunction::bspline2, ShapeFunction::cpdi}) {
      SCOPED_TRACE(testing::Message() << "release " << static_cast<int>(release) << ", shape "
                                      << static_cast<int>(shape));
      Case c = colliding_balls(2, 24, 6);
      c.contact.release = release, c.solver.shape = shape;
      check_momentum<2>(c, 100);
    }
}
TEST(Conservation, MomentumForEveryStressUpdate) {
  for (StressUpdate update : all_updates) {
    SCOPED_TRACE(static_cast<int>(update));
    Case c = colliding_balls(2, 24, 6);
    c.solver.stress_update = update;
    // Velocities p/m at nodes of vanishing mass make "last" unstable in contact: only its start is asked for.
    check_momentum<2>(c, update == StressUpdate::last ? 60 : 100);
  }
}
TEST(Conservation, MomentumOfBalls) {
  Case c = colliding_balls(3, 12, 4);
  check_momentum<3>(c, 50);
  c.solver.shape = ShapeFunction::cpdi, c.solver.motion = Motion::projected;
  check_momentum<3>(c, 50);
}
TEST(Conservation, MomentumAcrossPeriodicBoundaries) {
  Case c = colliding_balls(2, 24, 12);
  c.domain.periodic = {true, true, false};
  for (auto& body : c.bodies) body.velocity *= -1;  // they meet around the corner
  check_momentum<2>(c, 160);
}
TEST(Conservation, MomentumOfPlasticAndHypoelasticBodies) {
  Case c = colliding_balls(2, 24, 6);
  c.materials[0] = {
      "metal",
      "von_mises",
      1000,
      {{"shear_modulus", 4e3}, {"bulk_modulus", soft_bulk}, {"yield_stress", 100.0}, {"hardening_modulus", 50.0}}};
  c.materials.push_back({"rubber", "hypoelastic", 700, {{"shear_modulus", 3e3}, {"bulk_modulus", 5e3}}});
  c.bodies[1].material = 1;
  check_momentum<2>(c, 100);
}

// Sticking contact ----------------------------------------------------------------------------------------------------

/// A block and a disk that touch, run into each other: as two bodies, or as one body made of both.
Case touching_pair(bool one_body, ContactLaw law, StressUpdate update) {
  Case c = soft_case(2, 20, 5);
  const BoxShape block{Vec3(0.23, 0.31, 0), Vec3(0.52, 0.59, 0), 0};
  const Ball disk{Vec3(0.67, 0.47, 0), 0.149};
  if (one_body)
    add_body(c, Compound{CompoundOperation::union_of, {block, disk}});
  else
    add_body(c, block), add_body(c, disk);
  c.contact.law = law;
  c.solver.stress_update = update;
  c.time.dt = 1e-3;                          // a third of a cell at the wave speed
  c.solver.noise_filter = NoiseFilter::off;  // which looks at each body by itself
  c.solver.surface = Surface::whole;         // a compound with a block is not cut
  return c;
}

/// Runs 200 steps with velocities that depend on the starting position alone; points by that position.
std::map<std::pair<double, double>, SolverPoint<2>> run_pair(const Case& c) {
  using C = PointColumns<2>;
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  std::map<std::int64_t, std::pair<double, double>> start;
  for (auto& patch : simulation.patches())
    for (auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size(); ++p) {
        const double x = piece.points.column(0)[p], y = piece.points.column(1)[p];
        start[piece.points.ids()[p]] = {x, y};
        piece.points.column(C::velocity)[p] = x < 0.521 ? 0.3 : -0.2;
        piece.points.column(C::velocity + 1)[p] = x < 0.521 ? 0.1 : 0.2 * y;
      }
  for (int i = 0; i < 200; ++i) simulation.step(forever);
  std::map<std::pair<double, double>, SolverPoint<2>> result;
  for (const auto& [id, point] : points_of(simulation)) result.emplace(start.at(id), point);
  return result;
}

void check_sticking(StressUpdate update) {
  const auto two = run_pair(touching_pair(false, ContactLaw::stick, update));
  for (const Case& other :
       {touching_pair(false, ContactLaw::none, update), touching_pair(true, ContactLaw::stick, update)}) {
    const auto one = run_pair(other);
    ASSERT_EQ(one.size(), two.size());
    double difference = 0, motion = 0;
    for (const auto& [start, a] : two) {
      const auto& b = one.at(start);
      difference = std::max({difference, (a.x - b.x).norm(), (a.v - b.v).norm()});
      for (int i = 0; i < 4; ++i)
        difference = std::max(difference, std::abs(a.stress.c[i] - b.stress.c[i]) / soft_bulk);
      motion = std::max(motion, std::abs(a.stress.c[0]) / soft_bulk);
    }
    EXPECT_LE(difference, 1e-10);
    EXPECT_GT(motion, 1e-3) << "nothing happened";
  }
}
TEST(Sticking, IsOneVelocityFieldWithLast) { check_sticking(StressUpdate::last); }
TEST(Sticking, IsOneVelocityFieldWithFirst) { check_sticking(StressUpdate::first); }
TEST(Sticking, IsOneVelocityFieldWithBoth) { check_sticking(StressUpdate::both); }
TEST(Sticking, IsOneVelocityFieldWithModifiedLast) { check_sticking(StressUpdate::modified_last); }

// Rigid motions -------------------------------------------------------------------------------------------------------

template <int Dim>
void check_translation(StressUpdate update, const Vec3& velocity, int cells, int patch_cells) {
  Case c = soft_case(Dim, cells, patch_cells);
  c.domain.periodic = {true, true, Dim == 3};
  c.solver.stress_update = update;
  c.time.dt = 0.18 / cells;  // up to a fifth of a cell in a step, across the domain and more in the run
  add_body(c, Ball{Vec3(0.31, 0.57, Dim == 3 ? 0.43 : 0), 0.2}, velocity);
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const auto start = points_of(simulation);
  const int steps = cells * 7;
  for (int i = 0; i < steps; ++i) simulation.step(forever);
  const double time = steps * c.time.dt;
  EXPECT_NEAR(simulation.time(), time, 1e-12);
  EXPECT_LE(largest_stress(simulation), 1e-11 * soft_bulk);
  const auto now = points_of(simulation);
  ASSERT_EQ(now.size(), start.size());
  for (const auto& [id, point] : now) {
    const Vec<Dim> v = velocity.head<Dim>();
    EXPECT_LE((point.v - v).norm(), 1e-12);
    EXPECT_LE((point.x - start.at(id).x - time * v).norm(), 1e-12);
  }
}
TEST(RigidMotion, TranslationStaysFreeOfStress) {
  for (StressUpdate update : all_updates) {
    SCOPED_TRACE(static_cast<int>(update));
    check_translation<2>(update, Vec3(1, -0.6, 0), 16, 4);   // four patches wide
    check_translation<2>(update, Vec3(-0.3, 0.9, 0), 8, 4);  // two
    check_translation<2>(update, Vec3(1, 1, 0), 6, 4);       // one: its own neighbour
  }
  check_translation<3>(StressUpdate::both, Vec3(0.5, -0.9, 0.7), 8, 4);
}

template <int Dim>
void check_fall(StressUpdate update) {
  const double dt = 1e-3;
  const int steps = 300;
  Case c = soft_case(Dim, Dim == 2 ? 20 : 10, 5);
  c.domain.gravity = MotionTable(Vec3(1, -8, Dim == 3 ? 0.5 : 0));
  c.solver.stress_update = update, c.time.dt = dt;
  add_body(c, Ball{Vec3(0.41, 0.67, Dim == 3 ? 0.43 : 0), 0.2});
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const auto start = points_of(simulation);
  const Totals totals = simulation.totals();
  for (int i = 0; i < steps; ++i) simulation.step(forever);
  const Vec<Dim> g = c.domain.gravity.at(0).head<Dim>();
  for (const auto& [id, point] : points_of(simulation)) {  // v_n = n g dt, x_n = x_0 + n (n + 1)/2 g dt^2
    EXPECT_LE((point.v - steps * dt * g).norm(), 1e-12);
    EXPECT_LE((point.x - start.at(id).x - 0.5 * steps * (steps + 1) * dt * dt * g).norm(), 1e-12);
  }
  EXPECT_LE(largest_stress(simulation), 1e-11 * soft_bulk);
  // Kinetic energy gained is potential energy lost, up to the half step by which positions run ahead.
  const Totals now = simulation.totals();
  const double gained = now.kinetic - totals.kinetic, lost = totals.potential - now.potential;
  EXPECT_NEAR(lost / gained, 1 + 1.0 / steps, 1e-10);
}
TEST(RigidMotion, FreeFallIsExact) {
  for (StressUpdate update : all_updates) check_fall<2>(update);
  check_fall<3>(StressUpdate::both);
}

double angular_momentum(const Simulation<2>& simulation) {
  double sum = 0;
  for (const auto& [id, p] : points_of(simulation)) sum += p.mass * (p.x[0] * p.v[1] - p.x[1] * p.v[0]);
  return sum;
}

/// Share of its angular momentum that a disk of radius 0.3 loses in one turn.
double spin_loss(int cells) {
  Case c = soft_case(2, cells, 6);
  c.time.cfl = 0.4;
  add_body(c, Ball{Vec3(0.513, 0.487, 0), 0.3}, Vec3::Zero(), Vec3(0, 0, 0.6));
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  const double start = angular_momentum(simulation), turn = 2 * std::numbers::pi / 0.6;
  const Totals totals = simulation.totals();
  while (simulation.time() < turn) simulation.step(turn - simulation.time());
  EXPECT_LE((simulation.totals().momentum - totals.momentum).norm(), 1e-12 * totals.mass);
  return 1 - angular_momentum(simulation) / start;
}

TEST(RigidMotion, SpinningDiskKeepsItsAngularMomentum) {
  // Nodes hold the mass at their place, not where its centre is: the error shrinks with the square of the cell's size.
  const double coarse = spin_loss(16), fine = spin_loss(24);
  EXPECT_LT(std::abs(coarse), 0.13);
  EXPECT_LT(std::abs(fine), 0.05);
  EXPECT_GT(coarse / fine, 2.0);  // (24/16)^2 = 2.25
}

template <int Dim>
void check_driven() {
  Case c = soft_case(Dim, 16, 4);
  c.domain.periodic = {true, false, false};
  c.time.dt = 0.012;
  const Vec3 centre(0.45, 0.5, Dim == 3 ? 0.5 : 0), velocity(0.9, 0.05, 0);
  const Vec3 spin = Dim == 3 ? Vec3(1.1, -0.7, 2.3) : Vec3(0, 0, 2.3);
  add_body(c, BoxShape{centre - Vec3(0.12, 0.2, 0.15), centre + Vec3(0.12, 0.2, 0.15), 0.3});
  Drive drive;
  drive.ids = {0}, drive.velocity = velocity, drive.angular_velocity = spin;
  c.drives.push_back(drive);
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const auto start = points_of(simulation);
  for (int i = 0; i < 100; ++i) simulation.step(forever);
  const double t = 100 * c.time.dt;
  const Mat3 turn = Eigen::AngleAxisd(spin.norm() * t, spin.normalized()).toRotationMatrix();
  for (const auto& [id, point] : points_of(simulation)) {
    Vec3 arm = Vec3::Zero();
    arm.head<Dim>() = start.at(id).x - centre.head<Dim>();
    const Vec3 x = centre + t * velocity + turn * arm, v = velocity + spin.cross(turn * arm);
    EXPECT_LE((point.x - x.head<Dim>()).norm(), 1e-12);
    EXPECT_LE((point.v - v.head<Dim>()).norm(), 1e-12);
  }
}
TEST(RigidMotion, DrivenBodyTurnsExactly2D) { check_driven<2>(); }
TEST(RigidMotion, DrivenBodyTurnsExactly3D) { check_driven<3>(); }

}  // namespace
}  // namespace cairn
