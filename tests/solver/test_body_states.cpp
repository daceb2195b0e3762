// Motion of whole bodies: centre, velocity and angular velocity, as in bodies.csv and the grain files.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"
#include "cairn/solver/body_states.hpp"

namespace cairn {
namespace {

using namespace test;

/// A body that moves and spins at once, reaching across several patches: its state is the motion it was given.
template <int Dim>
void check_motion(const Shape& shape, bool periodic) {
  Case c = soft_case(Dim, Dim == 2 ? 24 : 12, 4);
  const double z = Dim == 3 ? 1 : 0;
  c.domain.periodic = {periodic, periodic, false};
  const Vec3 velocity(0.3, -0.2, 0.1 * z), spin(0.7 * z, -1.1 * z, 2.3);
  add_body(c, shape, velocity, spin);
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const BodyState s = body_states(simulation).at(0);
  // The points' centre differs a little from the shape's, and moves as a point of the rigid body.
  EXPECT_LE((s.centre - centre(shape)).norm(), 0.3 / 12);
  const Vec3 expected = velocity + spin.cross(s.centre - centre(shape));
  EXPECT_LE((s.velocity - expected).norm(), 1e-12);
  EXPECT_LE((s.angular_velocity - spin).norm(), 1e-11);
  EXPECT_NEAR(s.mass, simulation.totals().mass, 1e-12 * s.mass);
}
TEST(BodyStates, MotionOfADiskAndABlock) {
  check_motion<2>(Ball{Vec3(0.47, 0.53, 0), 0.23}, false);
  check_motion<2>(BoxShape{Vec3(0.2, 0.31, 0), Vec3(0.8, 0.57, 0), 0.4}, false);
}
TEST(BodyStates, MotionOfASphereAndABlock) {
  check_motion<3>(Ball{Vec3(0.47, 0.53, 0.51), 0.23}, false);
  check_motion<3>(BoxShape{Vec3(0.2, 0.3, 0.35), Vec3(0.8, 0.6, 0.55), 0.4}, false);
}
TEST(BodyStates, MotionAcrossPeriodicBoundaries) {
  check_motion<2>(Ball{Vec3(0.97, 0.06, 0), 0.23}, true);
  check_motion<3>(Ball{Vec3(0.06, 0.97, 0.51), 0.23}, true);
}

/// Mass and centre of a ball whose surface is cut, over several patches and across the boundary.
template <int Dim>
void check_cut(const Vec3& at) {
  Case c = soft_case(Dim, Dim == 2 ? 24 : 12, 4);
  c.domain.periodic = {true, true, false};
  c.solver.surface = Surface::cut;
  const double radius = 0.23;
  add_body(c, Ball{at, radius}, Vec3::Zero(), Vec3::Zero());
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const BodyState s = body_states(simulation).at(0);
  const double volume =
      Dim == 2 ? std::numbers::pi * radius * radius : 4 / 3.0 * std::numbers::pi * std::pow(radius, 3);
  EXPECT_NEAR(s.mass / (c.materials[0].density * volume), 1, 2e-3);
  EXPECT_LE((s.centre - at).norm(), 2e-4);
}
TEST(BodyStates, CutSurfacesKeepMassAndCentre) {
  check_cut<2>(Vec3(0.47, 0.53, 0));
  check_cut<2>(Vec3(0.97, 0.06, 0));
  check_cut<3>(Vec3(0.47, 0.53, 0.51));
  check_cut<3>(Vec3(0.06, 0.97, 0.51));
}

// Two halves of a square whose common face goes through points, along the grid or across it: each point is of one half.
/// Two balls that meet across a boundary touch there, however the domain is cut into patches: the same point, and the
/// same sum of force times place about it.
TEST(BodyStates, AContactAcrossAPeriodicBoundaryLiesThere) {
  Eigen::Matrix2d moments[2];
  for (const int patch_cells : {4, 24}) {
    Case c = soft_case(2, 24, patch_cells);
    c.domain.periodic = {true, false, false};
    c.output.contacts.every = 1;
    add_body(c, Ball{Vec3(0.795, 0.5, 0), 0.2}, Vec3(0.5, 0, 0));
    add_body(c, Ball{Vec3(0.205, 0.52, 0), 0.2}, Vec3(-0.5, 0, 0));
    Simulation<2> simulation(c, MPI_COMM_WORLD);
    for (int i = 0; i < 40; ++i) simulation.step(1e300);
    const auto contacts = contact_states(simulation, simulation.time());
    ASSERT_EQ(contacts.size(), 1u);
    const ContactState& contact = contacts[0];
    EXPECT_GT(contact.force.norm(), 1);
    EXPECT_LT(std::abs(contact.point.x() - std::round(contact.point.x())), 0.03) << patch_cells;
    EXPECT_NEAR(contact.point.y(), 0.51, 0.03);
    moments[patch_cells == 24] = (contact.moment - contact.force * contact.point.transpose()).topLeftCorner<2, 2>();
  }
  EXPECT_LT(moments[0].norm(), 20);
  EXPECT_LT((moments[0] - moments[1]).norm(), 1e-9 * moments[0].norm());
}

TEST(BodyStates, BodiesThatTouchShareNoPoints) {
  for (double middle : {0.5 + 0.25 / 24, 0.5 + 0.75 / 24, 0.51})
    for (bool polygons : {false, true}) {
      Case c = soft_case(2, 24, 4);
      const auto add = [&](double low, double high) {
        if (polygons)
          add_body(c, Polygon{{Vec3(0.25, low, 0), Vec3(0.75, low, 0), Vec3(0.75, high, 0), Vec3(0.25, high, 0)}},
                   Vec3::Zero(), Vec3::Zero());
        else
          add_body(c, BoxShape{Vec3(0.25, low, 0), Vec3(0.75, high, 0)}, Vec3::Zero(), Vec3::Zero());
      };
      add(0.25, middle), add(middle, 0.75);
      Simulation<2> simulation(c, MPI_COMM_WORLD);
      EXPECT_NEAR(simulation.totals().mass, 0.25 * c.materials[0].density, 1e-9 * c.materials[0].density);
    }
  for (double other : {0.25, 0.75}) {  // both diagonals
    Case c = soft_case(2, 24, 4);
    const Vec3 a(0.25, other, 0), b(0.75, 1 - other, 0);
    for (double side : {0.25, 0.75})
      add_body(c, Polygon{{a, b, Vec3(side == other ? 0.75 : 0.25, side, 0)}}, Vec3::Zero(), Vec3::Zero());
    Simulation<2> simulation(c, MPI_COMM_WORLD);
    EXPECT_NEAR(simulation.totals().mass, 0.25 * c.materials[0].density, 1e-9 * c.materials[0].density);
  }
}

}  // namespace
}  // namespace cairn
