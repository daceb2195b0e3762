// The law of CONTRIBUTING.md, read from that page, is a law like the others.

#include <gtest/gtest.h>

#include "../support/material_point.hpp"
#include "cairn/core/lanes.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double K = 2e5;  // [Pa]

TEST(Recipe, TheRegistryKnowsTheLawAndItsParameters) {
  const LawInfo* info = find_law("gas");
  ASSERT_NE(info, nullptr);
  ASSERT_EQ(info->parameters.size(), 1u);
  EXPECT_EQ(info->parameters[0].key, "bulk_modulus");
  EXPECT_FALSE(info->has_plane_stress);
  EXPECT_TRUE(std::holds_alternative<Gas>(make_law("gas", {{"bulk_modulus", K}})));
}

template <int Dim>
void check_point() {
  MaterialPoint<Dim, Gas> point{Gas({{"bulk_modulus", K}})};
  Random random;
  double work = 0;
  for (int i = 0; i < 2000; ++i) {
    const Mat3 old = point.stress, A = 1e-4 * random_matrix<Dim>(random, 1.0) + 5e-5 * Mat3::Identity().eval();
    Mat3 step = A;
    if (Dim == 2) step(2, 2) = 0;
    EXPECT_EQ(point.advance(step), K);
    work += 0.5 * point.F.determinant() * ((old + point.stress) * step.transpose()).trace();
  }
  const double J = point.F.determinant();
  ASSERT_GT(std::abs(J - 1), 0.05);
  EXPECT_LE((point.stress - K * (1 - 1 / J) * Mat3::Identity()).norm(), 1e-13 * K);
  EXPECT_NEAR(point.strain_energy(), work, 2e-3 * work);  // the stress is that of the energy
}
TEST(Recipe, StressInClosedFormAndItsWork) {
  check_point<2>();
  check_point<3>();
}

TEST(Recipe, EightPointsAtOnce) {
  const Gas law({{"bulk_modulus", K}});
  Tensor<3, Lanes> A{}, F{};
  Symmetric<3, Lanes> stress{};
  for (int i = 0; i < 3; ++i) F.c[tensor_index<3>(i, i)] = Lanes{} + 1.0;
  for (int lane = 0; lane < 8; ++lane) A.c[0][lane] = 0.01 * lane;
  Lanes* none = nullptr;
  advance_point(law, A, F, stress, none);
  for (int lane = 0; lane < 8; ++lane) {
    const double J = determinant(F)[lane];
    EXPECT_NEAR(stress.c[0][lane], K * (1 - 1 / J), 1e-12 * K);
  }
}

}  // namespace
}  // namespace cairn
