// The generalised Maxwell law against the closed forms of linear viscoelasticity, and its energies.

#include <gtest/gtest.h>

#include <complex>
#include <numbers>

#include "../support/material_point.hpp"

namespace cairn {
namespace {

using namespace test;

const double G = 3e6, K = 70e6;                                        // long term [Pa]
const double moduli[] = {8e6, 4e6, 2e6}, times[] = {1e-3, 1e-2, 0.3};  // [Pa], [s]

template <int Branches>
Viscoelastic<Branches> law_of(double stretch_times = 1) {
  ParameterValues v = {{"shear_modulus", G}, {"bulk_modulus", K}};
  for (int i = 0; i < Branches; ++i)
    v[list_key("branch_moduli", i)] = moduli[i], v[list_key("branch_times", i)] = times[i] * stretch_times;
  return Viscoelastic<Branches>(v);
}

Mat3 shear(double size) {
  Mat3 A = Mat3::Zero();
  A(0, 1) = size;
  return A;
}

TEST(Viscoelastic, RelaxesAsTheSumOfExponentials) {
  MaterialPoint<3, Viscoelastic<3>> point{law_of<3>()};
  const double g = 1e-6;
  point.advance(shear(g), 0);  // at once
  EXPECT_NEAR(point.stress(0, 1), (G + 14e6) * g, 1e-5 * G * g);
  double t = 0;
  for (double dt : {1e-5, 1e-4, 1e-4, 1e-3, 5e-3, 0.02, 0.5, 3.0}) {  // of any length: each is exact
    point.advance(Mat3::Zero(), dt);
    t += dt;
    double modulus = G;
    for (int i = 0; i < 3; ++i) modulus += moduli[i] * std::exp(-t / times[i]);
    EXPECT_NEAR(point.stress(0, 1), modulus * g, 1e-5 * modulus * g);
  }
}

TEST(Viscoelastic, ConstantRateIsExactForAnyStep) {
  // tau = G g' t + sum G_i tau_i g' (1 - exp(-t/tau_i)).
  for (int steps : {1, 3, 1000}) {
    MaterialPoint<2, Viscoelastic<3>> point{law_of<3>()};
    const double rate = 1e-5, end = 0.02;
    for (int i = 0; i < steps; ++i) point.advance(shear(rate * end / steps), end / steps);
    double expected = G * rate * end;
    for (int i = 0; i < 3; ++i) expected += moduli[i] * times[i] * rate * -std::expm1(-end / times[i]);
    EXPECT_NEAR(point.stress(0, 1), expected, 1e-6 * expected);
  }
}

TEST(Viscoelastic, HarmonicShearGivesStorageAndLossModulus) {
  // G* = G + sum G_i i w tau_i / (1 + i w tau_i); the loss of a cycle is pi G'' g^2.
  const double omega = 2 * std::numbers::pi * 30, g = 1e-4;
  std::complex<double> modulus = G;
  for (int i = 0; i < 3; ++i)
    modulus += moduli[i] * std::complex(0.0, omega * times[i]) / std::complex(1.0, omega * times[i]);
  MaterialPoint<3, Viscoelastic<3>> point{law_of<3>()};
  const int steps = 2000, cycles = 60;
  const double dt = 2 * std::numbers::pi / omega / steps;
  double in_phase = 0, out_of_phase = 0, before = 0;
  for (int i = 0; i < cycles * steps; ++i) {
    const double now = omega * i * dt, next = omega * (i + 1) * dt;
    if (i == (cycles - 1) * steps) before = point.law.viscous_dissipation(point.state);
    point.advance(shear(g * (std::sin(next) - std::sin(now))), dt);
    if (i < (cycles - 1) * steps) continue;
    in_phase += 2.0 / steps * point.stress(0, 1) / g * std::sin(next);
    out_of_phase += 2.0 / steps * point.stress(0, 1) / g * std::cos(next);
  }
  EXPECT_NEAR(in_phase, modulus.real(), 1e-4 * std::abs(modulus));
  EXPECT_NEAR(out_of_phase, modulus.imag(), 1e-4 * std::abs(modulus));
  const double loss = point.law.viscous_dissipation(point.state) - before;
  EXPECT_NEAR(loss, std::numbers::pi * modulus.imag() * g * g, 1e-4 * loss);
}

/// With very long relaxation times a branch is elastic; with very short ones it is not there.
TEST(Viscoelastic, LimitsOfTheRelaxationTime) {
  Random random;
  const ParameterValues stiff = {{"shear_modulus", G + 14e6}, {"bulk_modulus", K}},
                        soft = {{"shear_modulus", G}, {"bulk_modulus", K}};
  MaterialPoint<3, Viscoelastic<3>> slow{law_of<3>(1e12)}, fast{law_of<3>(1e-15)};
  MaterialPoint<3, NeoHookean> instant{NeoHookean(stiff)}, long_term{NeoHookean(soft)};
  const Mat3 small = random_matrix<3>(random, 1e-4), large = random_matrix<3>(random, 0.02);
  slow.advance(small, 1e-5), instant.advance(small);
  EXPECT_LE((slow.stress - instant.stress).norm(), 1e-3 * instant.stress.norm());  // to first order in the strain
  EXPECT_NEAR(slow.strain_energy(), instant.strain_energy(), 1e-3 * instant.strain_energy());
  EXPECT_LE(slow.state[0], 1e-12 * slow.strain_energy());
  for (int i = 0; i < 20; ++i) fast.advance(large, 1e-2), long_term.advance(large);
  EXPECT_LE((fast.stress - long_term.stress).norm(), 1e-8 * long_term.stress.norm());
  EXPECT_NEAR(fast.strain_energy(), long_term.strain_energy(), 1e-8 * long_term.strain_energy());
}

/// Dissipation never falls; what is stored and dissipated is the work done, for steps short and long against the times.
TEST(Viscoelastic, EnergyBalancesAndDissipationIsNotNegative) {
  Random random;
  for (double dt : {1e-6, 1e-3, 0.1}) {
    MaterialPoint<3, Viscoelastic<3>> point{law_of<3>()};
    double work = 0;
    Mat3 A = random_matrix<3>(random, 1e-4);
    for (int i = 0; i < 300; ++i) {
      if (i % 20 == 0) A = random_matrix<3>(random, 1e-4);
      const double before = point.state[0];
      // The overstress is integrated exactly, so its work is found by many short steps of the same rate.
      for (int part = 0; part < 64; ++part) {
        const Mat3 old = point.F.determinant() * point.stress;
        point.advance(A / 64, dt / 64);
        work += 0.5 * ((old + point.F.determinant() * point.stress) * A / 64).trace();
      }
      EXPECT_GE(point.state[0], before);
    }
    EXPECT_GT(point.state[0], 0);
    EXPECT_NEAR(point.strain_energy() + point.state[0], work, 3e-4 * point.state[0] + 1e-4 * point.strain_energy());
  }
}

TEST(Viscoelastic, DissipationDoesNotDependOnTheStep) {
  double found[2];
  for (int level = 0; level < 2; ++level) {
    MaterialPoint<3, Viscoelastic<3>> point{law_of<3>()};
    const int steps = level == 0 ? 1 : 5000;
    for (int i = 0; i < steps; ++i) point.advance(shear(1e-5 / steps), 0.02 / steps);
    for (int i = 0; i < steps; ++i) point.advance(Mat3::Zero(), 0.05 / steps);
    found[level] = point.state[0];
  }
  EXPECT_NEAR(found[0], found[1], 1e-5 * found[1]);
}

TEST(Viscoelastic, BranchesThatRelaxAlikeAreOne) {
  ParameterValues one = {{"shear_modulus", G}, {"bulk_modulus", K}, {"branch_moduli.0", 6e6}, {"branch_times.0", 0.1}};
  ParameterValues two = one;
  two["branch_moduli.0"] = 2e6, two["branch_moduli.1"] = 4e6, two["branch_times.1"] = 0.1;
  MaterialPoint<2, Viscoelastic<1>> single{Viscoelastic<1>(one)};
  MaterialPoint<2, Viscoelastic<2>> pair{Viscoelastic<2>(two)};
  Random random;
  for (int i = 0; i < 50; ++i) {
    const Mat3 A = random_matrix<2>(random, 0.02);
    single.advance(A, 0.01), pair.advance(A, 0.01);
  }
  EXPECT_LE((single.stress - pair.stress).norm(), 1e-12 * single.stress.norm());
  EXPECT_NEAR(single.state[0], pair.state[0], 1e-12 * pair.state[0]);
}

TEST(Viscoelastic, RegistryChoosesTheNumberOfBranches) {
  ParameterValues v = {{"shear_modulus", G}, {"bulk_modulus", K}};
  EXPECT_ANY_THROW(make_law("viscoelastic", v));
  for (int i = 0; i < most_branches; ++i) {
    v[list_key("branch_moduli", i)] = 1e6, v[list_key("branch_times", i)] = 1.0;
    const Law law = make_law("viscoelastic", v);
    const auto branches = std::visit([](const auto& l) { return (l.state_names.size() - 1) / 5; }, law);
    EXPECT_EQ(branches, i + 1u);
  }
}

}  // namespace
}  // namespace cairn
