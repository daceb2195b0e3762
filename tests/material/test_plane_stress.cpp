// Plane stress of every law that has it: sigma_zz = 0, against closed forms and scalar root-finds of its own.

#include <gtest/gtest.h>

#include "../support/material_point.hpp"

namespace cairn {
namespace {

using namespace test;

const double G = 30e6, K = 70e6, Y = 0.2e6, H = 5e6;  // [Pa]
const double E = 9 * K * G / (3 * K + G), nu = (3 * K - 2 * G) / (2 * (3 * K + G));
const ParameterValues values = {{"shear_modulus", G},     {"bulk_modulus", K},       {"yield_stress", Y},
                                {"hardening_modulus", H}, {"branch_moduli.0", 20e6}, {"branch_moduli.1", 5e6},
                                {"branch_times.0", 1e-3}, {"branch_times.1", 0.1}};

template <class ConcreteLaw>
ConcreteLaw flat_law(ParameterValues v = values) {
  ConcreteLaw law(v);
  law.plane = Plane::stress;
  return law;
}
template <class ConcreteLaw>
using Flat = MaterialPoint<2, ConcreteLaw>;

/// Stretches a point along x by the increments `A_xx`, its width free: finds A_yy with sigma_yy = 0 by bisection.
template <class ConcreteLaw>
void pull(Flat<ConcreteLaw>& point, double A_xx, double dt = 1e-4) {
  double low = -4 * std::abs(A_xx) - 1e-12, high = -low;
  Flat<ConcreteLaw> trial = point;
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    trial = point;
    trial.advance(Vec3(A_xx, middle, 0).asDiagonal(), dt);
    (trial.stress(1, 1) > 0 ? high : low) = middle;
  }
  point = trial;
}

template <class ConcreteLaw>
void check_small_strain(double shear) {
  const double young = 9 * K * shear / (3 * K + shear), poisson = (3 * K - 2 * shear) / (2 * (3 * K + shear));
  Flat<ConcreteLaw> pulled{flat_law<ConcreteLaw>()};
  const double e = 1e-7;
  pull(pulled, e, 0);
  EXPECT_NEAR(pulled.stress(0, 0), young * e, 2e-6 * young * e);
  EXPECT_NEAR(pulled.F(1, 1) - 1, -poisson * e, 2e-6 * e);
  EXPECT_NEAR(pulled.F(2, 2) - 1, -poisson * e, 2e-6 * e);
  // In general: sigma = E/(1 - nu^2) [(1 - nu) e + nu tr(e) I] in the plane.
  Random random;
  const Mat3 strain = e * random_symmetric<2>(random, 1).cwiseProduct(Mat3(Vec3(1, 1, 0) * Vec3(1, 1, 0).transpose()));
  Flat<ConcreteLaw> general{flat_law<ConcreteLaw>()};
  general.advance(strain);
  Mat3 expected =
      young / (1 - poisson * poisson) * ((1 - poisson) * strain + poisson * strain.trace() * Mat3::Identity());
  expected(2, 2) = 0;
  EXPECT_LE((general.stress - expected).norm(), 2e-6 * expected.norm());
}
TEST(PlaneStress, SmallStrainIsHookesLawInThePlane) {
  check_small_strain<NeoHookean>(G);
  check_small_strain<Hypoelastic>(G);
  check_small_strain<VonMises>(G);
  check_small_strain<Viscoelastic<2>>(G + 25e6);  // at once: no time to relax
}

/// Cauchy stress and stretches of a neo-Hookean bar pulled to the stretch `a`: the lateral stretch by bisection.
std::pair<double, double> neo_hookean_bar(double a) {
  const auto mean = [&](double l) { return 0.5 * K * (a * l * l - 1 / (a * l * l)); };
  const auto shear = [&](double l) { return G * std::pow(a * l * l, -5.0 / 3) * (a * a - l * l); };
  double low = 1e-3, high = 10;
  for (int i = 0; i < 200; ++i) {
    const double l = 0.5 * (low + high);
    (mean(l) - shear(l) / 3 > 0 ? high : low) = l;
  }
  return {mean(low) + 2.0 / 3 * shear(low), low};
}
TEST(PlaneStress, NeoHookeanBarAtLargeStretch) {
  for (double step : {0.02, -0.02}) {
    Flat<NeoHookean> bar{flat_law<NeoHookean>()};
    for (int i = 0; i < 50; ++i) pull(bar, step);
    const auto [stress, width] = neo_hookean_bar(bar.F(0, 0));
    EXPECT_GT(std::abs(bar.F(0, 0) - 1), 0.6);
    EXPECT_NEAR(bar.stress(0, 0), stress, 1e-11 * G);
    EXPECT_NEAR(bar.F(1, 1), width, 1e-12);
    EXPECT_NEAR(bar.F(2, 2), width, 1e-12);
    EXPECT_LE(std::abs(bar.stress(2, 2)), 1e-14 * K);
  }
}

/// Large random motions, in steps from minute to far beyond what a time step allows; det F varies many times over.
template <class ConcreteLaw>
void check_stress_free(ParameterValues v) {
  Random random;
  const double modulus = v.at("bulk_modulus") + 2 * v.at("shear_modulus");
  for (double size : {1e-5, 1e-3, 0.05, 0.1}) {
    double worst = 0;
    for (int k = 0; k < 50; ++k) {
      Flat<ConcreteLaw> point{flat_law<ConcreteLaw>(v)};
      for (int i = 0; i < 20; ++i) {
        Mat3 A = random_matrix<2>(random, size);
        A(2, 2) = 0;
        point.advance(A, 1e-4);
        worst = std::max(worst, std::abs(point.stress(2, 2)));
      }
    }
    EXPECT_LE(worst, 2e-14 * modulus) << ConcreteLaw::name << ", steps of " << size;
  }
}
TEST(PlaneStress, NoStressAcrossThePlane) {
  for (double bulk : {5e6, 70e6, 3e9}) {  // Poisson's ratio -0.6, 0.31 and 0.495
    ParameterValues v = values;
    v["bulk_modulus"] = bulk;
    check_stress_free<NeoHookean>(v);
    check_stress_free<Hypoelastic>(v);
    check_stress_free<VonMises>(v);
    check_stress_free<Viscoelastic<2>>(v);
    v["hardening_modulus"] = 0;
    check_stress_free<VonMises>(v);
  }
}

TEST(PlaneStress, VonMisesYieldsAtTheYieldStress) {
  for (double sign : {1.0, -1.0})
    for (double hardening : {0.0, H}) {
      ParameterValues v = values;
      v["hardening_modulus"] = hardening;
      Flat<VonMises> bar{flat_law<VonMises>(v)};
      const double yield_strain = Y / E;
      for (int i = 0; i < 19; ++i) pull(bar, sign * 0.05 * yield_strain);
      EXPECT_EQ(bar.state[0], 0.0);
      EXPECT_NEAR(bar.stress(0, 0), sign * 0.95 * Y, 1e-3 * Y);
      for (int i = 0; i < 400; ++i) pull(bar, sign * 0.05 * yield_strain);
      // Uniaxial: sigma = Y + H p, and the logarithmic strain is sigma/E + p.
      const double strain = sign * std::log(bar.F(0, 0)), p = (strain - Y / E) / (1 + hardening / E);
      EXPECT_NEAR(bar.state[0], p, 1e-6 * p);
      EXPECT_NEAR(bar.stress(0, 0), sign * (Y + hardening * p), 1e-8 * Y);
      EXPECT_NEAR(von_mises_stress(bar.stress), Y + hardening * bar.state[0], 1e-12 * Y);
      EXPECT_LE(std::abs(bar.stress(1, 1)), 1e-12 * K);
    }
}

TEST(PlaneStress, VonMisesBelowYieldIsHypoelastic) {
  Random random;
  Flat<VonMises> plastic{flat_law<VonMises>()};
  Flat<Hypoelastic> elastic{flat_law<Hypoelastic>()};
  for (int i = 0; i < 20; ++i) {
    Mat3 A = random_matrix<2>(random, 1e-4);
    A(2, 2) = 0;
    plastic.advance(A), elastic.advance(A);
    EXPECT_EQ(plastic.state[0], 0.0);
    EXPECT_LE((plastic.stress - elastic.stress).norm(), 1e-14 * K);
    EXPECT_LE((plastic.F - elastic.F).norm(), 1e-15);
  }
}

/// The work done in the plane is all the work there is: the energy found is its integral.
TEST(PlaneStress, NeoHookeanEnergyIsTheWorkInThePlane) {
  Flat<NeoHookean> bar{flat_law<NeoHookean>()};
  const int steps = 4000;
  double work = 0, old = 0;
  for (int i = 0; i < steps; ++i) {
    const double A = 0.3 / steps;
    bar.advance(Vec3(A, 0, 0).asDiagonal());
    const double now = bar.F.determinant() * bar.stress(0, 0);
    work += 0.5 * (old + now) * A;
    old = now;
  }
  EXPECT_NEAR(bar.strain_energy(), work, 1e-6 * work);
}

/// The bits of a point are the same in any lane and beside any other points.
template <class ConcreteLaw>
void check_bits() {
  Random random;
  constexpr int states = static_cast<int>(ConcreteLaw::state_names.size());
  const auto law = law_of_step(flat_law<ConcreteLaw>(), 1e-4);
  Tensor<2, double> A[lane_count], F[lane_count];
  Symmetric<2, double> stress[lane_count];
  double state[states + 1][lane_count] = {};
  for (int lane = 0; lane < lane_count; ++lane) {
    Mat3 a = random_matrix<2>(random, lane < 4 ? 1e-4 : 0.05);
    a(2, 2) = 0;
    A[lane] = tensor<2>(a);
    F[lane] = tensor<2>(Mat3::Identity() + random_matrix<2>(random, 0.2));
    Mat3 s = random_symmetric<2>(random, Y);
    s(2, 2) = 0;
    stress[lane] = symmetric<2>(s);
    for (int i = 0; i < states; ++i) state[i][lane] = random(0, i == 0 ? 1e-3 : 1e4);
  }
  std::array<double, 9 + states> first[lane_count];
  for (int turn = 0; turn < lane_count; ++turn) {
    Tensor<2, double> A_turned[lane_count], F_turned[lane_count];
    Symmetric<2, double> stress_turned[lane_count];
    Lanes all_state[states + 1] = {};
    for (int lane = 0; lane < lane_count; ++lane) {
      const int from = (lane + turn) % lane_count;
      A_turned[lane] = A[from], F_turned[lane] = F[from], stress_turned[lane] = stress[from];
      for (int i = 0; i < states; ++i) all_state[i][lane] = state[i][from];
    }
    auto all_F = gather_lanes(F_turned);
    auto all_stress = gather_lanes(stress_turned);
    advance_point(law, gather_lanes(A_turned), all_F, all_stress, all_state);
    for (int lane = 0; lane < lane_count; ++lane) {
      std::array<double, 9 + states> bits;
      for (int i = 0; i < 5; ++i) bits[i] = all_F.c[i][lane];
      for (int i = 0; i < 4; ++i) bits[5 + i] = all_stress.c[i][lane];
      for (int i = 0; i < states; ++i) bits[9 + i] = all_state[i][lane];
      auto& known = first[(lane + turn) % lane_count];
      if (turn == 0)
        known = bits;
      else
        EXPECT_EQ(known, bits) << ConcreteLaw::name;
    }
  }
}
TEST(PlaneStress, BitsDoNotDependOnTheLane) {
  check_bits<NeoHookean>();
  check_bits<Hypoelastic>();
  check_bits<VonMises>();
  check_bits<Viscoelastic<2>>();
}

TEST(PlaneStress, IsAskedOfTheRegistry) {
  EXPECT_EQ(std::get<VonMises>(make_law("von_mises", values)).plane, Plane::strain);
  EXPECT_EQ(std::get<VonMises>(make_law("von_mises", values, Plane::stress)).plane, Plane::stress);
  for (const auto& law : law_infos()) EXPECT_EQ(law.has_plane_stress, law.name != "rigid");
}

}  // namespace
}  // namespace cairn
