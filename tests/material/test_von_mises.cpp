// Von Mises plasticity against closed forms: the return to the yield surface, the work and the energies.

#include <gtest/gtest.h>

#include "../support/material_point.hpp"

namespace cairn {
namespace {

using namespace test;

const double G = 30e6, K = 70e6, Y = 0.2e6, H = 5e6;  // [Pa]

VonMises von_mises(double hardening) {
  return VonMises({{"shear_modulus", G}, {"bulk_modulus", K}, {"yield_stress", Y}, {"hardening_modulus", hardening}});
}

template <int Dim>
void check_yield_surface() {
  Random random;
  for (double hardening : {0.0, H}) {
    MaterialPoint<Dim, VonMises> point{von_mises(hardening)};
    int yielded = 0;
    for (int i = 0; i < 200; ++i) {
      const double before = point.state[0];
      const double pressure = point.stress.trace();
      const Mat3 A = random_matrix<Dim>(random, 5e-3);
      point.advance_at(A, 1.0);
      const double limit = Y + hardening * point.state[0];
      EXPECT_GE(point.state[0], before);
      if (point.state[0] > before) {
        ++yielded;
        EXPECT_NEAR(von_mises_stress(point.stress), limit, 1e-12 * limit);
      } else {
        EXPECT_LE(von_mises_stress(point.stress), limit * (1 + 1e-13));
      }
      EXPECT_NEAR(point.stress.trace() - pressure, 3 * K * A.trace(), 1e-11 * K);  // no plastic volume change
    }
    EXPECT_GT(yielded, 50);
  }
}
TEST(VonMisesLaw, ReturnsToTheYieldSurface) {
  check_yield_surface<2>();
  check_yield_surface<3>();
}

/// Return by the shortest way: the deviator keeps the direction of the elastic predictor.
TEST(VonMisesLaw, ReturnIsRadial) {
  Random random;
  for (int k = 0; k < 20; ++k) {
    MaterialPoint<3, VonMises> plastic{von_mises(H)};
    MaterialPoint<3, Hypoelastic> elastic{Hypoelastic({{"shear_modulus", G}, {"bulk_modulus", K}})};
    const Mat3 A = random_symmetric<3>(random, 0.1);
    plastic.advance(A), elastic.advance(A);
    ASSERT_GT(plastic.state[0], 0);
    EXPECT_LE((deviator(plastic.stress).normalized() - deviator(elastic.stress).normalized()).norm(), 1e-13);
    // Equivalent plastic strain: what the elastic predictor lies beyond the surface, over 3G + H.
    const double excess = von_mises_stress(elastic.stress) - Y;
    EXPECT_NEAR(plastic.state[0], excess / (3 * G + H), 1e-13);
  }
}

/// Uniaxial strain: q = 2G e up to Y, then q = Y + H p with p = (2G e - Y)/(3G + H); sigma = K e + 2/3 q.
TEST(VonMisesLaw, UniaxialStrainFollowsTheClosedForm) {
  const double longest = 20 * Y / (2 * G);
  for (int direction = 0; direction < 2; ++direction)
    for (double sign : {1.0, -1.0}) {
      MaterialPoint<2, VonMises> point{von_mises(H)};
      Mat3 A = Mat3::Zero();
      const int steps = 80;
      A(direction, direction) = sign * longest / steps;
      for (int i = 1; i <= steps; ++i) {
        point.advance_at(A, 1.0);
        const double e = longest * i / steps, p = std::max(0.0, (2 * G * e - Y) / (3 * G + H));
        const double q = p > 0 ? Y + H * p : 2 * G * e;
        EXPECT_NEAR(point.stress(direction, direction), sign * (K * e + 2.0 / 3 * q), 1e-12 * K * longest);
        EXPECT_NEAR(point.stress(1 - direction, 1 - direction), sign * (K * e - q / 3), 1e-12 * K * longest);
        EXPECT_NEAR(point.state[0], p, 1e-14);
      }
    }
}

/// Elastic energy in closed form, from the stress.
double elastic_energy(const Mat3& s) {
  const double q = von_mises_stress(s);
  return s.trace() * s.trace() / (18 * K) + q * q / (6 * G);
}

/// Monotonic uniaxial strain to 20 yield strains in `steps` steps; yield falls on the end of a step.
MaterialPoint<3, VonMises> strained(double hardening, int steps) {
  MaterialPoint<3, VonMises> point{von_mises(hardening)};
  Mat3 A = Mat3::Zero();
  A(0, 0) = 20 * Y / (2 * G) / steps;
  for (int i = 0; i < steps; ++i) point.advance_at(A, 1.0);
  return point;
}

TEST(VonMisesLaw, PlasticWorkIsTheIntegral) {
  // Perfectly plastic: Y p exactly. Hardening: Y p + H p^2/2, the error vanishing with the step at least linearly.
  const auto perfect = strained(0.0, 40);
  EXPECT_NEAR(perfect.state[2], Y * perfect.state[0], 1e-12 * perfect.state[2]);
  double error[2];
  for (int level = 0; level < 2; ++level) {
    const auto point = strained(H, 200 << level);
    const double p = point.state[0], exact = Y * p + 0.5 * H * p * p;
    error[level] = std::abs(point.state[2] - exact) / exact;
    EXPECT_EQ(point.law.plastic_work(point.state), point.state[2]);
  }
  EXPECT_LT(error[0], 5e-3);
  EXPECT_LE(error[1], 0.51 * error[0] + 1e-13);
}

TEST(VonMisesLaw, EnergyBalances) {
  // Stress work = strain energy + plastic work; the strain energy is that of the stress.
  const auto perfect = strained(0.0, 40);
  const auto energy = [](const MaterialPoint<3, VonMises>& p) { return p.strain_energy(); };
  EXPECT_NEAR(energy(perfect), elastic_energy(perfect.stress), 1e-11 * perfect.state[1]);
  double error[2];
  for (int level = 0; level < 2; ++level) {
    const auto point = strained(H, 200 << level);
    error[level] = std::abs(energy(point) - elastic_energy(point.stress)) / point.state[1];
  }
  EXPECT_LT(error[0], 2e-3);
  EXPECT_LE(error[1], 0.51 * error[0] + 1e-13);
}

}  // namespace
}  // namespace cairn
