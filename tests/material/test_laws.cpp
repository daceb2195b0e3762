// Constitutive laws against their energies, closed forms and invariances.

#include <gtest/gtest.h>

#include <numbers>

#include "../support/material_point.hpp"
#include "cairn/core/error.hpp"

namespace cairn {
namespace {

using namespace test;

const double G = 30e6, K = 70e6, Y = 0.2e6, H = 5e6;  // [Pa]
const ParameterValues values = {
    {"shear_modulus", G}, {"bulk_modulus", K}, {"yield_stress", Y}, {"hardening_modulus", H}};

/// Stress of small strain `e` by Hooke's law.
Mat3 hooke(const Mat3& e) { return 2 * G * e + (K - 2 * G / 3) * e.trace() * Mat3::Identity(); }

template <int Dim>
Mat3 neo_hookean_stress(const Mat3& F) {
  Symmetric<Dim, double> s{};
  double* none = nullptr;
  NeoHookean(values).update(Tensor<Dim, double>{}, tensor<Dim>(F), F.determinant(), s, none);
  return matrix(s);
}

// Neo-Hookean ---------------------------------------------------------------------------------------------------------

/// First Piola stress J sigma F^-T against dW/dF by central differences.
template <int Dim>
void check_energy_derivative() {
  Random random;
  const NeoHookean law(values);
  const double h = 1e-5;
  for (int k = 0; k < 20; ++k) {
    const Mat3 F = Mat3::Identity() + random_matrix<Dim>(random, 0.3);
    const Mat3 P = F.determinant() * neo_hookean_stress<Dim>(F) * F.inverse().transpose();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        if (!stored<Dim>(i, j)) continue;
        Mat3 up = F, down = F;
        up(i, j) += h, down(i, j) -= h;
        const double slope =
            (law.strain_energy(tensor<Dim>(up), nullptr) - law.strain_energy(tensor<Dim>(down), nullptr)) / (2 * h);
        EXPECT_NEAR(P(i, j), slope, 2e-8 * (P.norm() + G));
      }
  }
}
TEST(NeoHookeanLaw, StressIsTheDerivativeOfTheEnergy) {
  check_energy_derivative<2>();
  check_energy_derivative<3>();
}

TEST(NeoHookeanLaw, ReferenceIsFreeOfStressAndEnergy) {
  EXPECT_LE(neo_hookean_stress<2>(Mat3::Identity()).norm(), 1e-15 * K);
  EXPECT_LE(neo_hookean_stress<3>(Mat3::Identity()).norm(), 1e-15 * K);
  EXPECT_NEAR(NeoHookean(values).strain_energy(tensor<3>(Mat3::Identity()), nullptr), 0, 1e-15 * K);
}

TEST(NeoHookeanLaw, DilationAndSimpleShearInClosedForm) {
  // F = a I: sigma = K/2 (a^3 - a^-3) I. Simple shear g: J = 1, sigma_xy = G g, sigma_xx - sigma_yy = G g^2.
  const double a = 1.3, g = 0.7;
  const Mat3 swollen = neo_hookean_stress<3>(a * Mat3::Identity());
  EXPECT_LE((swollen - 0.5 * K * (a * a * a - 1 / (a * a * a)) * Mat3::Identity()).norm(), 1e-14 * K);
  Mat3 F = Mat3::Identity();
  F(0, 1) = g;
  for (const Mat3& s : {neo_hookean_stress<2>(F), neo_hookean_stress<3>(F)}) {
    EXPECT_NEAR(s(0, 1), G * g, 1e-14 * G);
    EXPECT_NEAR(s(0, 0) - s(1, 1), G * g * g, 1e-14 * G);
    EXPECT_NEAR(s.trace(), 0, 1e-14 * K);
  }
}

template <int Dim>
void check_rotated_stress() {
  Random random;
  for (int k = 0; k < 50; ++k) {
    const Mat3 F = Mat3::Identity() + random_matrix<Dim>(random, 0.3), R = random_rotation<Dim>(random);
    const Mat3 s = neo_hookean_stress<Dim>(F);
    EXPECT_LE((neo_hookean_stress<Dim>(R * F) - R * s * R.transpose()).norm(), 1e-13 * (s.norm() + G));
    EXPECT_LE((neo_hookean_stress<Dim>(F * R) - s).norm(), 1e-13 * (s.norm() + G));  // isotropic
  }
}
TEST(NeoHookeanLaw, TurnsWithTheBodyAndIsIsotropic) {
  check_rotated_stress<2>();
  check_rotated_stress<3>();
}

// Small strain --------------------------------------------------------------------------------------------------------

/// Strains: uniaxial, shear, hydrostatic (within what the dimension can hold), general.
template <int Dim>
std::vector<Mat3> strains(double size) {
  Random random;
  Mat3 uniaxial = Mat3::Zero(), shear = Mat3::Zero();
  uniaxial(0, 0) = size;
  shear(0, 1) = shear(1, 0) = size;
  return {uniaxial, -uniaxial, shear, size * Mat3::Identity(), random_symmetric<Dim>(random, size)};
}

template <int Dim, class ConcreteLaw>
void check_small_strain(const ConcreteLaw& law, double tolerance) {
  for (const Mat3& e : strains<Dim>(1e-7)) {
    MaterialPoint<Dim, ConcreteLaw> point{law};
    const double modulus = point.advance(e);
    EXPECT_LE((point.stress - hooke(e)).norm(), tolerance * hooke(e).norm());
    EXPECT_NEAR(modulus, K + 4 * G / 3, 1e-6 * K);
  }
}
TEST(Laws, FollowHookeAtSmallStrain) {
  check_small_strain<2>(NeoHookean(values), 1e-6);
  check_small_strain<3>(NeoHookean(values), 1e-6);
  check_small_strain<2>(Hypoelastic(values), 1e-14);
  check_small_strain<3>(Hypoelastic(values), 1e-14);
  check_small_strain<2>(VonMises(values), 1e-14);
  check_small_strain<3>(VonMises(values), 1e-14);
}

TEST(Laws, PlaneStrainIsThreeDimensional) {
  Random random;
  for (int k = 0; k < 20; ++k) {
    const Mat3 A = random_matrix<2>(random, 0.05);
    MaterialPoint<2, VonMises> flat{VonMises(values)};
    MaterialPoint<3, VonMises> solid{VonMises(values)};
    for (int i = 0; i < 5; ++i) flat.advance(A), solid.advance(A);
    EXPECT_LE((flat.stress - solid.stress).norm(), 1e-12 * solid.stress.norm());
    EXPECT_NEAR(flat.state[0], solid.state[0], 1e-13);
  }
}

TEST(HypoelasticLaw, EnergyIsTheStressWork) {
  Random random;
  MaterialPoint<3, Hypoelastic> point{Hypoelastic(values)};
  const Mat3 e = random_symmetric<3>(random, 1e-4);
  for (int i = 0; i < 10; ++i) point.advance_at(e, 1.0);
  const double exact = 0.5 * (point.stress * (10 * e)).trace();
  EXPECT_NEAR(point.strain_energy(), exact, 1e-13 * exact);
  // The work belongs to a reference volume: a point of current volume J does J times as much.
  MaterialPoint<3, Hypoelastic> swollen{Hypoelastic(values)};
  for (int i = 0; i < 10; ++i) swollen.advance_at(e, 1.7);
  EXPECT_NEAR(swollen.state[0], 1.7 * exact, 1e-13 * exact);
}

// Rotation ------------------------------------------------------------------------------------------------------------

/// A stressed point turned rigidly through ten turns keeps its invariants; after n steps it is turned by n 2 atan(w/2).
template <int Dim, class ConcreteLaw>
void check_rigid_rotation(const ConcreteLaw& law) {
  const int steps = 1000;
  const double w = 10 * 2 * std::numbers::pi / steps;
  Random random;
  MaterialPoint<Dim, ConcreteLaw> point{law};
  point.advance(random_symmetric<Dim>(random, 1e-3));
  const Mat3 start = point.stress;
  const Vec3 axis = Dim == 2 ? Vec3(Vec3::UnitZ()) : Vec3(Vec3(1, 2, -0.5).normalized());
  constexpr int work_at = std::is_same_v<ConcreteLaw, VonMises> ? 1 : 0;
  const double work = point.state[work_at];
  for (int i = 0; i < steps; ++i) point.advance(w * cross_matrix(axis));
  EXPECT_NEAR(point.stress.trace(), start.trace(), 1e-12 * start.norm());
  EXPECT_NEAR(point.stress.norm(), start.norm(), 1e-12 * start.norm());
  EXPECT_NEAR(point.stress.determinant(), start.determinant(), 1e-12 * std::pow(start.norm(), 3));
  const Mat3 R = Eigen::AngleAxisd(steps * 2 * std::atan(w / 2), axis).toRotationMatrix();
  EXPECT_LE((point.stress - R * start * R.transpose()).norm(), 1e-11 * start.norm());
  EXPECT_NEAR(point.state[work_at], work, 1e-12 * work);
}
TEST(Laws, RigidRotationKeepsTheStress) {
  check_rigid_rotation<2>(Hypoelastic(values));
  check_rigid_rotation<3>(Hypoelastic(values));
  check_rigid_rotation<2>(VonMises(values));
  check_rigid_rotation<3>(VonMises(values));
}

/// A motion seen in a turned frame gives the turned stress.
template <int Dim, class ConcreteLaw>
void check_frame(const ConcreteLaw& law) {
  Random random;
  const Mat3 Q = random_rotation<Dim>(random);
  MaterialPoint<Dim, ConcreteLaw> point{law}, turned{law};
  for (int i = 0; i < 20; ++i) {
    const Mat3 A = random_matrix<Dim>(random, 0.02);
    point.advance(A);
    turned.advance(Q * A * Q.transpose());
    EXPECT_LE((turned.stress - Q * point.stress * Q.transpose()).norm(), 1e-12 * (point.stress.norm() + G));
  }
  EXPECT_NEAR(turned.state[0], point.state[0], 1e-12 * std::abs(point.state[0]));
}
TEST(Laws, KnowNoPreferredDirection) {
  check_frame<2>(NeoHookean(values));
  check_frame<3>(NeoHookean(values));
  check_frame<2>(Hypoelastic(values));
  check_frame<3>(Hypoelastic(values));
  check_frame<2>(VonMises(values));
  check_frame<3>(VonMises(values));
}

// Lanes and the registry ----------------------------------------------------------------------------------------------

template <int Dim, class ConcreteLaw>
void check_lanes(const ConcreteLaw& law) {
  Random random;
  Tensor<Dim, double> A[lane_count], F[lane_count];
  Symmetric<Dim, double> stress[lane_count];
  for (int lane = 0; lane < lane_count; ++lane) {
    A[lane] = tensor<Dim>(random_matrix<Dim>(random, lane < 4 ? 1e-3 : 1e-2));  // some yield, some do not
    F[lane] = tensor<Dim>(Mat3::Identity() + random_matrix<Dim>(random, 0.1));
    stress[lane] = symmetric<Dim>(random_symmetric<Dim>(random, lane % 2 == 0 ? 0.1 * Y : Y));
  }
  auto all_stress = gather_lanes(stress);
  Lanes all_state[8];
  for (int i = 0; i < 8; ++i) all_state[i] = broadcast(0.001);
  const auto all_F = gather_lanes(F);
  const Lanes modulus = law.update(gather_lanes(A), all_F, determinant(all_F), all_stress, all_state);
  for (int lane = 0; lane < lane_count; ++lane) {
    double state[8];
    std::fill_n(state, 8, 0.001);
    const double expected = law.update(A[lane], F[lane], determinant(F[lane]), stress[lane], state);
    EXPECT_NEAR(modulus[lane], expected, 1e-13 * K);
    for (int i = 0; i < symmetric_size<Dim>; ++i) EXPECT_NEAR(all_stress.c[i][lane], stress[lane].c[i], 1e-13 * K);
    for (std::size_t i = 0; i < law.state_names.size(); ++i)
      EXPECT_NEAR(all_state[i][lane], state[i], 1e-12 * std::abs(state[i]));
  }
}
TEST(Laws, LanesMatchPlainNumbers) {
  check_lanes<2>(NeoHookean(values));
  check_lanes<3>(NeoHookean(values));
  check_lanes<2>(Hypoelastic(values));
  check_lanes<3>(Hypoelastic(values));
  check_lanes<2>(VonMises(values));
  check_lanes<3>(VonMises(values));
}

TEST(Registry, BuildsEveryLawFromItsTable) {
  const auto key = [](const Parameter& p) { return p.most > 0 ? list_key(p.key, 0) : std::string(p.key); };
  ASSERT_EQ(law_infos().size(), 5u);  // one for each name
  for (const LawInfo& info : law_infos()) {
    ParameterValues table;
    for (const auto& parameter : info.parameters) {
      EXPECT_FALSE(parameter.meaning.empty());
      table[key(parameter)] = parameter.fallback.value_or(7.0);
    }
    const Law law = make_law(info.name, table);
    EXPECT_EQ(std::visit([](const auto& l) { return l.name; }, law), info.name);
    for (const auto& parameter : info.parameters) {
      ParameterValues incomplete = table;
      incomplete.erase(key(parameter));
      EXPECT_ANY_THROW(make_law(info.name, incomplete)) << info.name << " without " << parameter.key;
    }
  }
}

TEST(Registry, PassesParametersOn) {
  const auto law = std::get<VonMises>(make_law("von_mises", values));
  EXPECT_EQ(law.moduli.shear, G);
  EXPECT_EQ(law.moduli.bulk, K);
  EXPECT_EQ(law.yield_stress, Y);
  EXPECT_EQ(law.hardening_modulus, H);
  EXPECT_DOUBLE_EQ(law.moduli.longitudinal(), K + 4 * G / 3);
}

TEST(Registry, RefusesAnUnknownName) {
  try {
    make_law("rubber", values);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("rubber"), std::string::npos);
  }
}

TEST(RigidLaw, NeverStressed) {
  MaterialPoint<3, Rigid> point{Rigid(values)};
  EXPECT_EQ(point.advance(Mat3::Constant(0.1)), 0.0);
  EXPECT_EQ(point.stress.norm(), 0.0);
}

}  // namespace
}  // namespace cairn
