// The mean flow of all bodies: velocity gradient, shear rate, inertial number.

#include <gtest/gtest.h>
#include <mpi.h>

#include "../support/crack_cases.hpp"
#include "../support/mpi_environment.hpp"

namespace cairn {
namespace {

using namespace test;

/// Two balls that move as one flow does, under pressure.
template <int Dim>
void check_flow() {
  Case c = colliding_balls(Dim, Dim == 2 ? 40 : 16, Dim == 2 ? 10 : 8);
  c.domain.lower.head<Dim>().array() += 5, c.domain.upper.head<Dim>().array() += 5;  // far from 0
  for (auto& body : c.bodies) {
    std::get<Ball>(body.shape).centre.head<Dim>().array() += 5;
    body.initial_pressure = 40;
  }
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
  L.topLeftCorner<Dim, Dim>() =
      (Eigen::Matrix3d() << 0.3, -0.7, 0.2, 1.1, -0.5, 0.4, 0.6, -0.9, 0.8).finished().topLeftCorner<Dim, Dim>();
  Simulation<Dim> simulation(c, MPI_COMM_WORLD);
  set_velocities(simulation,
                 [&](const Vec<Dim>& x) -> Vec<Dim> { return (L.topLeftCorner<Dim, Dim>() * x).array() + 3; });
  const Totals t = simulation.totals();
  EXPECT_LT((t.velocity_gradient - L).norm(), 1e-10);

  double diagonal = 0, shears = 0;  // 2 D':D' written out
  for (int i = 0; i < Dim; ++i)
    for (int j = i + 1; j < Dim; ++j) {
      shears += std::pow(L(i, j) + L(j, i), 2);
      diagonal += 2.0 / Dim * std::pow(L(i, i) - L(j, j), 2);
    }
  const double rate = shear_rate(t.velocity_gradient, Dim);
  EXPECT_NEAR(rate, std::sqrt(diagonal + shears), 1e-10);

  const double a = std::pow(0.19, Dim) + std::pow(0.22, Dim), d = 2 * std::pow(a / 2, 1.0 / Dim);
  double pressure = 0;
  for (int i = 0; i < Dim; ++i) pressure -= t.stress[i] / Dim;
  const double density = t.deformable_mass / t.deformable_volume;
  EXPECT_NEAR(inertial_number(t, 2, Dim), rate * d * std::sqrt(density / pressure),
              0.02 * rate * d)  // cells at the rim
      << "volume " << t.deformable_volume;
  EXPECT_GT(pressure, 0);
  Totals pulled = t;
  for (double& s : pulled.stress) s = -s;
  EXPECT_EQ(inertial_number(pulled, 2, Dim), 0);
  EXPECT_EQ(inertial_number(t, 0, Dim), 0);
}
TEST(Flow, GradientAndInertialNumber2D) { check_flow<2>(); }
TEST(Flow, GradientAndInertialNumber3D) { check_flow<3>(); }

/// In simple shear the rate is that of shear.
TEST(Flow, RateOfSimpleShear) {
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
  L(0, 1) = -2.5;
  EXPECT_DOUBLE_EQ(shear_rate(L, 2), 2.5);
  EXPECT_DOUBLE_EQ(shear_rate(L, 3), 2.5);
}

}  // namespace
}  // namespace cairn
