// Tools: what bodies do to walls, fixed faces, drives and rigid bodies is the whole change of their momentum, on any
// number of ranks alike; given motions and pistons move as they must.

#include <gtest/gtest.h>

#include <cmath>

#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double forever = 1e300;

/// Balls thrown into a box whose faces are walls and one fixed face, with a turning drive and a plain rigid body in it.
template <int Dim>
Case crowded_box() {
  Case c = soft_case(Dim, Dim == 2 ? 24 : 12, 6);
  const double z = Dim == 3 ? 1 : 0;
  c.materials.push_back({"stone", "rigid", 2000, {}});
  add_body(c, Ball{Vec3(0.21, 0.2, 0.47 * z), 0.17}, Vec3(-0.5, -0.7, 0.2 * z), Vec3(0, 0, 1));
  add_body(c, Ball{Vec3(0.62, 0.21, 0.5 * z), 0.18}, Vec3(0.6, -0.4, -0.3 * z));
  add_body(c, BoxShape{Vec3(0.35, 0.47, 0.2 * z), Vec3(0.6, 0.58, 0.7 * z)});
  add_body(c, Ball{Vec3(0.83, 0.63, 0.5 * z), 0.15}, Vec3(0.4, 0.1, 0));
  add_body(c, BoxShape{Vec3(0.05, 0.55, 0.3 * z), Vec3(0.2, 0.65, 0.6 * z)});
  c.bodies[4].material = 1;
  Drive drive;
  drive.ids = {2}, drive.velocity = Vec3(0.1, -0.4, 0), drive.angular_velocity = Vec3(0, 0, 0.7);
  c.drives.push_back(drive);
  for (auto& face : c.faces) face.type = FaceType::wall, face.friction = 0.3;
  c.faces[1].type = FaceType::fixed;
  c.domain.gravity = Vec3(0.3, -2, 0);
  c.output.forces.every = 1;
  return c;
}

/// The same with walls that come in, one of them by a servo, gravity that turns, and a blade that turns about a corner.
template <int Dim>
Case moving_box() {
  Case c = crowded_box<Dim>();
  c.faces[0].velocity.formulas = {Formula("0.5 + 0.3 * sin(90 * t)"), Formula("0.2"), Formula("0")};
  c.faces[3].piston = {20, Vec3(0, -1, 0), Vec3(300, 0, 0), 200, 0.8, true};
  c.faces[2].position = 0.02;
  c.domain.gravity.formulas = {Formula("2 * cos(40 * t)"), Formula("-2"), Formula("0")};
  c.drives[0].about = Vec3(0.3, 0.4, 0);
  return c;
}

template <int Dim>
void check_momentum(StressUpdate update, bool moving = false) {
  Case c = moving ? moving_box<Dim>() : crowded_box<Dim>();
  c.solver.stress_update = update;
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  Totals before = simulation.totals();
  double largest = 0;
  for (int i = 0; i < 80; ++i) {
    const Vec3 gravity = c.domain.gravity.at(simulation.time());
    simulation.step(forever);
    simulation.step_state();
    const Totals now = simulation.totals();
    const std::vector<ToolSum> sums = simulation.tool_sums();
    if (rank != 0) continue;
    Vec3 given = simulation.dt() * before.deformable_mass * gravity;
    for (const ToolSum& sum : sums) given -= Vec3(sum.last[0], sum.last[1], sum.last[2]);
    ASSERT_LE((now.momentum - before.momentum - given).norm(), 1e-12 * before.deformable_mass) << "step " << i;
    double work = 0;
    for (const ToolSum& sum : sums) work += sum.total[6];
    if (!moving) {  // else changing gravity works too
      ASSERT_NEAR(work, now.boundary_work, 1e-12 * now.kinetic);
    }
    for (const ToolSum& sum : sums) largest = std::max(largest, std::abs(sum.last[0]) / before.deformable_mass);
    before = now;
  }
  EXPECT_TRUE(rank != 0 || largest > 1e-3);
}
TEST(Tools, TakeTheWholeChangeOfMomentum) {
  for (StressUpdate update :
       {StressUpdate::last, StressUpdate::first, StressUpdate::both, StressUpdate::modified_last}) {
    SCOPED_TRACE(static_cast<int>(update));
    check_momentum<2>(update);
  }
  check_momentum<3>(StressUpdate::both);
  check_momentum<2>(StressUpdate::both, true);
  check_momentum<2>(StressUpdate::modified_last, true);
  check_momentum<3>(StressUpdate::both, true);
}

template <int Dim>
std::vector<double> sums_after(const Case& c, int steps, MPI_Comm comm) {
  Simulation<Dim> simulation(c, comm);
  for (int i = 0; i < steps; ++i) simulation.step(forever);
  simulation.step_state();
  std::vector<double> numbers = simulation.tool_states();
  for (const ToolSum& sum : simulation.tool_sums()) {
    numbers.insert(numbers.end(), sum.total.begin(), sum.total.end());
    numbers.insert(numbers.end(), sum.last.begin(), sum.last.end());
  }
  return numbers;
}

TEST(Tools, AreTheSameOnAnyNumberOfRanks) {
  Case c = crowded_box<2>();
  c.drives[0].piston.mass = 30, c.drives[0].piston.along = Vec3(0, -1, 0);
  c.drives[0].piston.force = Vec3(40, 0, 0);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  for (const Case& any : {c, moving_box<2>()}) {
    const auto alone = sums_after<2>(any, 60, MPI_COMM_SELF), together = sums_after<2>(any, 60, MPI_COMM_WORLD);
    if (rank == 0) {
      EXPECT_EQ(alone, together);
    }
  }
}

/// What was of the last step is forgotten where a body has left a patch to itself.
TEST(Tools, FeelNothingOnceABodyHasGone) {
  Case c = soft_case(2, 48, 4);
  add_body(c, Ball{Vec3(0.16, 0.5, 0), 0.12}, Vec3(-1, 0, 0));
  for (auto& face : c.faces) face.type = FaceType::wall;
  c.output.forces.every = 1;
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  double pressed = 0, last = 0;
  for (int i = 0; i < 500; ++i) {
    simulation.step(forever);
    if (i % 10 != 0) continue;
    const std::vector<ToolSum> sums = simulation.tool_sums();
    last = std::abs(sums[0].last[0]);
    pressed = std::max(pressed, last);
  }
  if (rank != 0) return;
  EXPECT_GT(pressed, 0);
  EXPECT_EQ(last, 0);
}

/// A rigid box on its own follows its table exactly, and a piston that nothing touches falls under its force.
TEST(Tools, MoveAsGiven) {
  Case c = soft_case(2, 24, 6);
  c.materials.push_back({"stone", "rigid", 2000, {}});
  add_body(c, Ball{Vec3(0.8, 0.2, 0), 0.15});
  add_body(c, BoxShape{Vec3(0.2, 0.6, 0), Vec3(0.4, 0.7, 0)});
  add_body(c, BoxShape{Vec3(0.6, 0.7, 0), Vec3(0.8, 0.8, 0)});
  c.bodies[1].material = c.bodies[2].material = 1;
  Drive table, piston;
  table.ids = {1}, piston.ids = {2};
  table.velocity.times = {0.0, 0.1, 0.2}, table.velocity.values = {Vec3(0, 0, 0), Vec3(1, -0.5, 0), Vec3(0, 0, 0)};
  table.angular_velocity.times = {0.0, 0.2};
  table.angular_velocity.values = {Vec3(0, 0, 0), Vec3(0, 0, 2)};
  piston.piston = {5.0, Vec3(0, -1, 0), Vec3(10, 0, 0)};
  c.drives = {table, piston};
  c.time.dt = 0.2 / 64;
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  const auto start = points_of(simulation);
  for (int i = 0; i < 64; ++i) simulation.step(forever);
  // The middle time is between two steps: the trapezoids are exact.
  const Tool &moved = simulation.tools()[tools_of_faces], &fallen = simulation.tools()[tools_of_faces + 1];
  EXPECT_LE((moved.travel - Vec3(0.1, -0.05, 0)).norm(), 1e-12);
  EXPECT_LE((moved.now - Vec3(0, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR(fallen.speed, 0.4, 1e-12);
  EXPECT_NEAR(fallen.travel[1], -0.5 * 2 * 0.2 * 0.2 * (1 + 1.0 / 64), 1e-12);
  const Mat3 turn = Eigen::AngleAxisd(0.2, Vec3::UnitZ()).toRotationMatrix();
  const Vec3 centre(0.3, 0.65, 0);
  for (const auto& [id, point] : points_of(simulation)) {
    if (point.body != 1 || !start.contains(id)) continue;
    Vec3 arm = Vec3::Zero();
    arm.head<2>() = start.at(id).x - centre.head<2>();
    const Vec3 x = centre + moved.travel + turn * arm;
    EXPECT_LE((point.x - x.head<2>()).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace cairn
