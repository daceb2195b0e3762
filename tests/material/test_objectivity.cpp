// A stressed point turned rigidly through ten turns: how far the invariants of its stress and det F drift.

#include <gtest/gtest.h>

#include <numbers>

#include "../support/material_point.hpp"

namespace cairn {
namespace {

using namespace test;

const ParameterValues values = {{"shear_modulus", 30e6},    {"bulk_modulus", 70e6},    {"yield_stress", 0.8e6},
                                {"hardening_modulus", 5e6}, {"branch_moduli.0", 20e6}, {"branch_moduli.1", 5e6},
                                {"branch_times.0", 1.0},    {"branch_times.1", 100.0}};

/// Largest differences on the way: of det F, and of the stress invariants over the stress's norm.
struct Drift {
  double volume = 0, pressure = 0, shear = 0, determinant = 0;

  template <class Point>
  void add(const Point& turned, const Point& resting) {
    const double size = resting.stress.norm();
    const auto raise = [](double& most, double difference) { most = std::max(most, std::abs(difference)); };
    raise(volume, turned.F.determinant() / resting.F.determinant() - 1);
    raise(pressure, (turned.stress.trace() - resting.stress.trace()) / size);
    raise(shear, (deviator(turned.stress).norm() - deviator(resting.stress).norm()) / size);
    raise(determinant, (turned.stress.determinant() - resting.stress.determinant()) / std::pow(size, 3));
  }
};

/// Strains a point by about `size`, then turns it ten times in 1000 steps a turn, a turn a second; a second point,
/// strained alike, rests meanwhile (its stress may relax). Turning swells det F by w^6/64 a step of angle w, 1e-11 in
/// all, and a hyperelastic pressure by K times that.
template <int Dim, class ConcreteLaw>
Drift turn_ten_times(const ConcreteLaw& law, const Vec3& axis, double size) {
  const int steps = 1000;
  const double angle = 2 * std::numbers::pi / steps, dt = 1.0 / steps;
  Random random;
  MaterialPoint<Dim, ConcreteLaw> turned{law}, resting{law};
  Mat3 strain = random_symmetric<Dim>(random, 0.1 * size);
  if (Dim == 2) strain(2, 2) = 0;
  for (int i = 0; i < 10; ++i) turned.advance(strain, dt), resting.advance(strain, dt);
  EXPECT_GT(resting.stress.norm(), 1e6 * size);
  Drift drift;
  for (int i = 0; i < 10 * steps; ++i) {
    turned.advance(angle * cross_matrix(axis), dt), resting.advance(Mat3::Zero(), dt);
    drift.add(turned, resting);
  }
  return drift;
}

template <int Dim, class ConcreteLaw>
void check_drift(const ConcreteLaw& law) {
  for (const double size : {1e-4, 0.03}) {
    const Drift d =
        turn_ten_times<Dim>(law, Dim == 2 ? Vec3(Vec3::UnitZ()) : Vec3(Vec3(1, 2, -0.5).normalized()), size);
    std::printf("%d-D %-12s%s strain %g: det F %.1e, pressure %.1e, deviator %.1e, det %.1e\n", Dim,
                ConcreteLaw::name.data(), law.plane == Plane::stress ? " (plane stress)" : "", size, d.volume,
                d.pressure, d.shear, d.determinant);
    EXPECT_LT(d.volume, 2e-11);
    for (const double drift : {d.pressure, d.shear, d.determinant}) EXPECT_LT(drift, 1e-6);
  }
}

template <class ConcreteLaw>
void check_all() {
  ConcreteLaw law(values);
  check_drift<2>(law);
  check_drift<3>(law);
  law.plane = Plane::stress;
  check_drift<2>(law);
}
TEST(Objectivity, NeoHookean) { check_all<NeoHookean>(); }
TEST(Objectivity, Hypoelastic) { check_all<Hypoelastic>(); }
TEST(Objectivity, VonMises) { check_all<VonMises>(); }
TEST(Objectivity, Viscoelastic) { check_all<Viscoelastic<2>>(); }

/// A motion seen in a turned frame gives the turned stress.
TEST(Objectivity, ViscoelasticKnowsNoPreferredDirection) {
  Random random;
  const Mat3 Q = random_rotation<3>(random);
  MaterialPoint<3, Viscoelastic<2>> point{Viscoelastic<2>(values)}, turned = point;
  for (int i = 0; i < 50; ++i) {
    const Mat3 A = random_matrix<3>(random, 0.02);
    point.advance(A, 0.1), turned.advance(Q * A * Q.transpose(), 0.1);
    EXPECT_LE((turned.stress - Q * point.stress * Q.transpose()).norm(), 1e-12 * 70e6);
  }
  EXPECT_NEAR(turned.state[0], point.state[0], 1e-12 * point.state[0]);
}

}  // namespace
}  // namespace cairn
