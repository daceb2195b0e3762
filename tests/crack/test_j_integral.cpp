// The integrals of Williams' field, summed over points, give its intensities, whatever the radii and the direction.

#include <gtest/gtest.h>

#include <cmath>

#include "cairn/crack/j_integral.hpp"

namespace cairn {
namespace {

TEST(JIntegral, WilliamsFieldGivesItsIntensities) {
  const double mu = 3e9, nu = 0.3, modulus = 2 * mu / (1 - nu), K[2] = {1e6, -0.6e6};
  for (const double angle : {0.0, 0.7, 2.5}) {
    CrackTip tip;
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
        TipPoint point;
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
