// Tensors of a material point against Eigen.

#include <gtest/gtest.h>

#include <numbers>

#include "../support/tensors.hpp"

namespace cairn {
namespace {

using namespace test;

constexpr double round_off = 1e-14;
constexpr int samples = 200;

template <int Dim>
void check_algebra() {
  Random random;
  for (int k = 0; k < samples; ++k) {
    const Mat3 a = random_matrix<Dim>(random, 2), b = random_matrix<Dim>(random, 2);
    const auto A = tensor<Dim>(a), B = tensor<Dim>(b);
    EXPECT_LE((matrix(A * B) - a * b).norm(), round_off * a.norm() * b.norm());
    EXPECT_NEAR(determinant(A), a.determinant(), 10 * round_off * std::pow(a.norm(), 3));
    EXPECT_LE((matrix(left_cauchy_green(A)) - a * a.transpose()).norm(), round_off * a.squaredNorm());
    EXPECT_LE((matrix(symmetric_part(A)) - 0.5 * (a + a.transpose())).norm(), round_off * a.norm());

    const Mat3 s = random_symmetric<Dim>(random, 3), t = random_symmetric<Dim>(random, 3);
    const auto S = symmetric<Dim>(s), T = symmetric<Dim>(t);
    EXPECT_NEAR(trace(S), s.trace(), round_off * s.norm());
    EXPECT_NEAR(contraction(S, T), (s * t).trace(), 10 * round_off * s.norm() * t.norm());
    EXPECT_LE((matrix(scale_and_shift(S, 0.7, -1.3)) - (0.7 * s - 1.3 * Mat3::Identity())).norm(), round_off * 10);
  }
}
TEST(Tensor, AlgebraMatchesEigen2D) { check_algebra<2>(); }
TEST(Tensor, AlgebraMatchesEigen3D) { check_algebra<3>(); }

template <int Dim>
void check_index_maps() {
  std::vector<int> tensor_seen(tensor_size<Dim>, 0), symmetric_seen(symmetric_size<Dim>, 0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      if (!stored<Dim>(i, j)) continue;
      ++tensor_seen.at(tensor_index<Dim>(i, j));
      if (i <= j) ++symmetric_seen.at(symmetric_index<Dim>(i, j));
      EXPECT_EQ(symmetric_index<Dim>(i, j), symmetric_index<Dim>(j, i));
    }
  EXPECT_EQ(tensor_seen, std::vector<int>(tensor_size<Dim>, 1));
  EXPECT_EQ(symmetric_seen, std::vector<int>(symmetric_size<Dim>, 1));
}
TEST(Tensor, EveryComponentHasOnePlace) {
  check_index_maps<2>();
  check_index_maps<3>();
}

/// R s R^T with R = (I - W/2)^-1 (I + W/2), from small spins to more than half a turn in one step.
template <int Dim>
void check_rotation() {
  Random random;
  for (int k = 0; k < samples; ++k) {
    const double size = std::pow(10.0, random(-4, 1));
    const Mat3 a = random_matrix<Dim>(random, size), s = random_symmetric<Dim>(random, 5);
    const Mat3 half = 0.5 * skew_part(a), one = Mat3::Identity();
    const Mat3 R = (one - half).inverse() * (one + half);
    const Mat3 turned = matrix(rotate_by_spin(tensor<Dim>(a), symmetric<Dim>(s)));
    EXPECT_LE((turned - R * s * R.transpose()).norm(), 1e-13 * s.norm()) << "spin " << size;
    EXPECT_NEAR(turned.norm(), s.norm(), round_off * s.norm());
    EXPECT_NEAR(turned.trace(), s.trace(), round_off * s.norm());
  }
}
TEST(Tensor, SpinRotatesExactly2D) { check_rotation<2>(); }
TEST(Tensor, SpinRotatesExactly3D) { check_rotation<3>(); }

TEST(Tensor, SpinTurnsTheRightWay) {
  // A counterclockwise quarter turn about z carries sigma_xx to sigma_yy; W_yx = 2 gives exactly that.
  const Mat3 sigma = Vec3(1, 0, 0).asDiagonal();
  Mat3 spin = Mat3::Zero();
  spin(1, 0) = 2, spin(0, 1) = -2;
  const Mat3 upright = Vec3(0, 1, 0).asDiagonal();
  EXPECT_LE((matrix(rotate_by_spin(tensor<2>(spin), symmetric<2>(sigma))) - upright).norm(), round_off);
  // An eighth of a turn counterclockwise makes the shear positive.
  spin *= std::tan(std::numbers::pi / 8);
  EXPECT_NEAR(matrix(rotate_by_spin(tensor<2>(spin), symmetric<2>(sigma)))(0, 1), 0.5, round_off);
  EXPECT_NEAR(matrix(rotate_by_spin(tensor<3>(spin), symmetric<3>(sigma)))(0, 1), 0.5, round_off);
}

template <int Dim>
void check_deformation_order() {
  Random random;
  for (int k = 0; k < 20; ++k) {
    const Mat3 L = random_matrix<Dim>(random, 1), F = Mat3::Identity() + random_matrix<Dim>(random, 0.3);
    double error[2];
    for (int level = 0; level < 2; ++level) {
      const Mat3 A = L * (level == 0 ? 2e-2 : 1e-2);
      error[level] = (matrix(advance_deformation(tensor<Dim>(A), tensor<Dim>(F))) - exponential(A) * F).norm();
    }
    EXPECT_NEAR(error[0] / error[1], 8, 0.3);  // the first term left out is of third order
  }
}
TEST(Tensor, DeformationAdvancesToSecondOrder) {
  check_deformation_order<2>();
  check_deformation_order<3>();
}

template <int Dim>
double growth_in_a_turn() {
  const int steps = 1000;
  Mat3 A = Mat3::Zero();
  A(1, 0) = 2 * std::numbers::pi / steps, A(0, 1) = -A(1, 0);
  auto F = tensor<Dim>(Mat3::Identity());
  for (int i = 0; i < steps; ++i) F = advance_deformation(tensor<Dim>(A), F);
  return determinant(F) - 1;
}
TEST(Tensor, VolumeStaysInATurn) {
  EXPECT_LT(std::abs(growth_in_a_turn<2>()), 1e-6);
  EXPECT_LT(std::abs(growth_in_a_turn<3>()), 1e-6);
}

template <int Dim>
void check_lanes() {
  Random random;
  Tensor<Dim, double> A[lane_count], F[lane_count];
  Symmetric<Dim, double> S[lane_count];
  for (int lane = 0; lane < lane_count; ++lane) {
    A[lane] = tensor<Dim>(random_matrix<Dim>(random, 1));
    F[lane] = tensor<Dim>(Mat3::Identity() + random_matrix<Dim>(random, 0.3));
    S[lane] = symmetric<Dim>(random_symmetric<Dim>(random, 1));
  }
  const auto all_A = gather_lanes(A), all_F = gather_lanes(F);
  const auto all_S = gather_lanes(S);
  const auto advanced = advance_deformation(all_A, all_F);
  const auto turned = rotate_by_spin(all_A, all_S);
  const Lanes J = determinant(all_F);
  for (int lane = 0; lane < lane_count; ++lane) {
    const auto expected_F = advance_deformation(A[lane], F[lane]);
    const auto expected_S = rotate_by_spin(A[lane], S[lane]);
    for (int i = 0; i < tensor_size<Dim>; ++i) EXPECT_NEAR(advanced.c[i][lane], expected_F.c[i], round_off);
    for (int i = 0; i < symmetric_size<Dim>; ++i) EXPECT_NEAR(turned.c[i][lane], expected_S.c[i], round_off);
    EXPECT_NEAR(J[lane], determinant(F[lane]), round_off);
  }
}
TEST(Tensor, LanesMatchPlainNumbers) {
  check_lanes<2>();
  check_lanes<3>();
}

}  // namespace
}  // namespace cairn
