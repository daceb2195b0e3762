// Wheels on a shaft: rigid bodies that a moment and what bodies press turn about an axis.

#include <gtest/gtest.h>

#include <cmath>

#include "../support/cases.hpp"
#include "../support/mpi_environment.hpp"
#include "cairn/solver/body_states.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double forever = 1e300, inertia = 3;

/// A bar on a shaft through its middle, and a ball above one of its arms.
template <int Dim>
Case wheel_case() {
  const double z = Dim == 3 ? 1 : 0;
  Case c = soft_case(Dim, Dim == 2 ? 20 : 12, 4);
  c.materials.push_back({"stiff", "rigid", 1000, {}});
  add_body(c, BoxShape{Vec3(0.2, 0.45, 0.2 * z), Vec3(0.8, 0.55, 0.8 * z)});
  c.bodies[0].material = 1;
  add_body(c, Ball{Vec3(0.7, 0.8, 0.5 * z), 0.15}, Vec3(0.1, -1, 0));
  Drive drive;
  drive.ids = {0}, drive.about = Vec3(0.5, 0.5, 0.5 * z);
  drive.rotor.mass = inertia, drive.rotor.along = Vec3(0, 0, 1);
  c.drives = {drive};
  return c;
}

template <int Dim>
const Tool& wheel_of(const Simulation<Dim>& simulation) {
  return simulation.tools()[tools_of_faces];
}

TEST(Rotor, TurnsAsMomentAndDampingSay) {
  Case c = wheel_case<2>();
  c.bodies[1].velocity.setZero();
  c.bodies[1].shape = Ball{Vec3(0.9, 0.1, 0), 0.08};  // out of reach
  c.drives[0].rotor.force = Vec3(0.6, 0, 0), c.drives[0].rotor.damping = 2;
  c.time.dt = 1e-3;
  Simulation<2> simulation(c, MPI_COMM_WORLD);
  for (int i = 0; i < 400; ++i) simulation.step(forever);
  EXPECT_NEAR(wheel_of(simulation).spin_now.z(), 0.3 * (1 - std::exp(-2 / inertia * 0.4)), 1e-4);
}

/// Struck by a ball, both together keep their angular momentum about the shaft, which bears no moment.
template <int Dim>
void check_blow() {
  Case c = wheel_case<Dim>();
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  const auto momentum = [&] {
    const BodyState s = body_states(simulation).at(1);
    return s.angular_momentum.z() + s.mass * (s.centre - *c.drives[0].about).cross(s.velocity).z() +
           inertia * wheel_of(simulation).spin_now.z();
  };
  const double before = momentum();
  for (int i = 0; i < 150; ++i) simulation.step(forever);
  EXPECT_LT(wheel_of(simulation).spin_now.z(), -0.3 * std::abs(before) / inertia);
  EXPECT_NEAR(momentum(), before, 2e-3 * std::abs(before));
}
TEST(Rotor, AndABallKeepTheirAngularMomentum2D) { check_blow<2>(); }
TEST(Rotor, AndABallKeepTheirAngularMomentum3D) { check_blow<3>(); }

}  // namespace
}  // namespace cairn
