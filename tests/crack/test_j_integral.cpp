// The integrals of Williams' field, summed over points, give its intensities, whatever the radii and the direction.

#include <gtest/gtest.h>

#include <cmath>

#include "cairn/crack/j_integral.hpp"

namespace cairn {
namespace {

TEST(JIntegral, WilliamsFieldGivesItsIntensities) {
  const double mu = 3e9, nu = 0.3, modulus = 2 * mu / (1 - nu), K[2] = {1e6, -0.6e6};
  for (const double angle : {0.0, 0.7, 2.5}) {
    CrackTip<2> tip;
    tip.position = {0.3, -0.2}, tip.ahead = {std::cos(angle), std::sin(angle)};
    tip.modulus = modulus, tip.kappa = 3 - 4 * nu, tip.shear_modulus = mu;
    Eigen::Matrix2d axes;
    axes << tip.ahead.x(), tip.ahead.y(), -tip.ahead.y(), tip.ahead.x();
    const int n = 200;
    const double outer = 1, h = 2 * outer / n;
    TipSums sums;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const Vec<2> x(-outer + (i + 0.5) * h, -outer + (j + 0.5) * h);
        TipPoint<2> point;
        point.position = tip.position + axes.transpose() * x;
        point.velocity = point.acceleration = Vec<2>::Zero();
        point.L.setZero(), point.H.setZero(), point.stress.setZero();
        for (int mode = 0; mode < 2; ++mode) {
          const UnitField f = unit_field(mode, x, mu, tip.kappa);
          point.H += K[mode] * f.H, point.stress += K[mode] * f.stress;
        }
        point.energy = 0.5 * point.stress.cwiseProduct(point.H).sum();
        point.stress = axes.transpose() * point.stress * axes, point.H = axes.transpose() * point.H * axes;
        point.volume = h * h, point.density = 1;
        const TipSums add = tip_terms(tip, point, 0.25 * outer, outer);
        sums.J += add.J, sums.J_static += add.J_static, sums.I_opening += add.I_opening,
            sums.I_sliding += add.I_sliding;
      }
    const double J = (K[0] * K[0] + K[1] * K[1]) / modulus;
    EXPECT_NEAR(sums.J, J, 2e-3 * J);
    EXPECT_EQ(sums.J, sums.J_static);
    EXPECT_NEAR(0.5 * modulus * sums.I_opening, K[0], 2e-3 * K[0]);
    EXPECT_NEAR(0.5 * modulus * sums.I_sliding, K[1], 2e-3 * K[0]);
  }
}

/// The same along a straight rim in 3D, with all three modes, however the axes lie.
TEST(JIntegral, WilliamsFieldGivesItsIntensitiesAlongARim) {
  const double mu = 3e9, nu = 0.3, modulus = 2 * mu / (1 - nu), K[3] = {1e6, -0.6e6, 0.8e6};
  CrackTip<3> tip;
  tip.position = {0.3, -0.2, 0.1}, tip.normal = Vec<3>(0.3, 0.5, 0.8).normalized();
  tip.ahead = tip.normal.cross(Vec<3>(1, -0.3, 0.2)).normalized();
  tip.modulus = modulus, tip.kappa = 3 - 4 * nu, tip.shear_modulus = mu, tip.hat = 0.4;
  Eigen::Matrix3d axes;
  axes << tip.ahead.transpose(), tip.normal.transpose(), tip.ahead.cross(tip.normal).transpose();
  const int n = 120, layers = 8;
  const double outer = 1, h = 2 * outer / n, depth = 2 * tip.hat / layers;
  TipSums sums;
  double along = 0;  // the integral of q
  for (int k = 0; k < layers; ++k) {
    const double z = -tip.hat + (k + 0.5) * depth;
    along += depth * tip_weight<3>(tip, tip.position + axes.row(2).transpose() * z, 0.25 * outer, outer);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const Vec<2> x(-outer + (i + 0.5) * h, -outer + (j + 0.5) * h);
        TipPoint<3> point;
        point.position = tip.position + axes.transpose() * Vec<3>(x.x(), x.y(), z);
        point.velocity = point.acceleration = Vec<3>::Zero();
        point.L.setZero(), point.H.setZero(), point.stress.setZero();
        for (int mode = 0; mode < 3; ++mode) {
          const UnitField3D f = unit_field_3d(mode, x, mu, tip.kappa);
          point.H += K[mode] * f.H, point.stress += K[mode] * f.stress;
        }
        point.energy = 0.5 * point.stress.cwiseProduct(point.H).sum();
        point.stress = axes.transpose() * point.stress * axes, point.H = axes.transpose() * point.H * axes;
        point.volume = h * h * depth, point.density = 1;
        sums.add(tip_terms(tip, point, 0.25 * outer, outer));
      }
  }
  EXPECT_NEAR(along, tip.hat, 1e-12);
  const double J = (K[0] * K[0] + K[1] * K[1]) / modulus + K[2] * K[2] / (2 * mu);
  EXPECT_NEAR(sums.J / along, J, 3e-3 * J);
  EXPECT_NEAR(0.5 * modulus * sums.I_opening / along, K[0], 3e-3 * K[0]);
  EXPECT_NEAR(0.5 * modulus * sums.I_sliding / along, K[1], 3e-3 * K[0]);
  EXPECT_NEAR(mu * sums.I_tearing / along, K[2], 3e-3 * K[0]);
}

/// The unit fields are in equilibrium and obey Hooke's law.
TEST(JIntegral, UnitFieldsAreElastic) {
  const double mu = 2, nu = 0.25, kappa = 3 - 4 * nu, lambda = 2 * mu * nu / (1 - 2 * nu), d = 1e-5;
  for (int mode = 0; mode < 2; ++mode)
    for (const Vec<2>& x : {Vec<2>(0.3, 0.2), Vec<2>(-0.4, 0.1), Vec<2>(-0.2, -0.5)}) {
      const UnitField f = unit_field(mode, x, mu, kappa);
      const Eigen::Matrix2d strain = 0.5 * (f.H + f.H.transpose());
      const Eigen::Matrix2d hooke = 2 * mu * strain + lambda * strain.trace() * Eigen::Matrix2d::Identity();
      EXPECT_LE((hooke - f.stress).norm(), 1e-12 * f.stress.norm());
      Vec<2> force = Vec<2>::Zero();
      for (int j = 0; j < 2; ++j) {
        const Vec<2> step = d * Vec<2>::Unit(j);
        force += (unit_field(mode, x + step, mu, kappa).stress - unit_field(mode, x - step, mu, kappa).stress).col(j) /
                 (2 * d);
      }
      EXPECT_LE(force.norm(), 1e-6 * f.stress.norm());
    }
}

}  // namespace
}  // namespace cairn
