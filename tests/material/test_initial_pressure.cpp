// Laws under hydrostatic pressure from the start: the stress they go on with, and the energy they own.

#include <gtest/gtest.h>

#include "../support/material_point.hpp"

namespace cairn {
namespace {

using namespace test;

const double G = 30e6, K = 70e6;  // [Pa]
const ParameterValues values = {{"shear_modulus", G},     {"bulk_modulus", K},       {"yield_stress", 1e5},
                                {"hardening_modulus", 0}, {"branch_moduli.0", 20e6}, {"branch_times.0", 1e-3}};

template <int Dim, class ConcreteLaw>
MaterialPoint<Dim, ConcreteLaw> pressurised(double pressure) {
  MaterialPoint<Dim, ConcreteLaw> point{ConcreteLaw(values)};
  point.F *= std::cbrt(point.law.pressurise(pressure, point.state));
  point.stress = -pressure * Mat3::Identity();
  return point;
}

template <int Dim, class ConcreteLaw>
void check_pressure() {
  for (double pressure : {1e3, 5e6, -5e6, 7e7}) {
    auto point = pressurised<Dim, ConcreteLaw>(pressure);
    point.advance(Mat3::Zero(), 1e-4);
    EXPECT_LE((point.stress + pressure * Mat3::Identity()).norm(), 3e-15 * K + 1e-14 * std::abs(pressure))
        << ConcreteLaw::name;
    EXPECT_EQ(point.F.determinant() < 1, pressure > 0);
  }
}
TEST(InitialPressure, IsTheStressOfTheNextStep) {
  check_pressure<2, NeoHookean>();
  check_pressure<3, NeoHookean>();
  check_pressure<2, Hypoelastic>();
  check_pressure<3, Hypoelastic>();
  check_pressure<3, VonMises>();
  check_pressure<3, Viscoelastic<1>>();
}

/// Let go to no pressure, a point gives back the energy that it was given.
template <class ConcreteLaw>
void check_energy() {
  for (double pressure : {2e6, 2e7, -2e7}) {
    auto point = pressurised<3, ConcreteLaw>(pressure);
    const double given = point.strain_energy();
    EXPECT_NEAR(given, pressure * pressure / (2 * K), 0.3 * given);
    const int steps = 20000;
    const double target = -std::log(std::cbrt(point.F.determinant()));
    double work = 0;
    for (int i = 0; i < steps; ++i) {
      const Mat3 old = point.F.determinant() * point.stress, A = target / steps * Mat3::Identity();
      point.advance(A, 1e-6);
      work += 0.5 * ((old + point.F.determinant() * point.stress) * A).trace();
    }
    EXPECT_LE(std::abs(point.stress.trace()), 1e-6 * std::abs(pressure)) << ConcreteLaw::name;
    EXPECT_NEAR(-work, given, 1e-6 * given) << ConcreteLaw::name;
    // Rate forms weight the work of a step with det F at its end: within the strain of a step.
    EXPECT_NEAR(point.strain_energy(), 0, (1e-6 + 3 * std::abs(target) / steps) * given) << ConcreteLaw::name;
  }
}
TEST(InitialPressure, ItsEnergyComesBack) {
  check_energy<NeoHookean>();
  check_energy<Hypoelastic>();
  check_energy<VonMises>();
  check_energy<Viscoelastic<1>>();
}

TEST(InitialPressure, NoneChangesNothing) {
  double state[state_capacity] = {};
  EXPECT_EQ(NeoHookean(values).pressurise(0.0, state), 1.0);
  EXPECT_EQ(Hypoelastic(values).pressurise(0.0, state), 1.0);
  EXPECT_EQ(state[0], 0.0);
}

}  // namespace
}  // namespace cairn
