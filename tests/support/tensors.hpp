#pragma once
/// Tensors of a material point as Eigen matrices and back, and eight of them as one of Lanes.

#include <cmath>

#include "cairn/core/tensor.hpp"
#include "random.hpp"

namespace cairn::test {

/// True where component (i, j) is stored: in 2D the shears out of the plane are not.
template <int Dim>
constexpr bool stored(int i, int j) {
  return Dim == 3 || (i == 2) == (j == 2);
}

template <int Dim>
Mat3 matrix(const Tensor<Dim, double>& a) {
  Mat3 m = Mat3::Zero();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (stored<Dim>(i, j)) m(i, j) = a.c[tensor_index<Dim>(i, j)];
  return m;
}

template <int Dim>
Mat3 matrix(const Symmetric<Dim, double>& s) {
  Mat3 m = Mat3::Zero();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (stored<Dim>(i, j)) m(i, j) = s.c[symmetric_index<Dim>(i, j)];
  return m;
}

template <int Dim>
Tensor<Dim, double> tensor(const Mat3& m) {
  Tensor<Dim, double> a{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (stored<Dim>(i, j)) a.c[tensor_index<Dim>(i, j)] = m(i, j);
  return a;
}

template <int Dim>
Symmetric<Dim, double> symmetric(const Mat3& m) {
  Symmetric<Dim, double> s{};
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j)
      if (stored<Dim>(i, j)) s.c[symmetric_index<Dim>(i, j)] = m(i, j);
  return s;
}

/// Entries in [-size, size], zero where the dimension stores none.
template <int Dim>
Mat3 random_matrix(Random& random, double size) {
  Mat3 m = Mat3::Zero();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (stored<Dim>(i, j)) m(i, j) = random(-size, size);
  return m;
}

template <int Dim>
Mat3 random_symmetric(Random& random, double size) {
  const Mat3 m = random_matrix<Dim>(random, size);
  return 0.5 * (m + m.transpose());
}

/// A rotation that the dimension can represent.
template <int Dim>
Mat3 random_rotation(Random& random) {
  const Vec3 axis = Dim == 2 ? Vec3(Vec3::UnitZ()) : Vec3(random.unit_vector<3>());
  return Eigen::AngleAxisd(random(-3, 3), axis).toRotationMatrix();
}

inline Mat3 skew_part(const Mat3& a) { return 0.5 * (a - a.transpose()); }

/// exp(a) by its series, for small a.
inline Mat3 exponential(const Mat3& a) {
  Mat3 sum = Mat3::Identity(), term = Mat3::Identity();
  for (int k = 1; k < 30; ++k) {
    term = term * a / k;
    sum += term;
  }
  return sum;
}

inline double von_mises_stress(const Mat3& s) {
  const Mat3 deviator = s - s.trace() / 3 * Mat3::Identity();
  return std::sqrt(1.5) * deviator.norm();
}

/// Eight values side by side.
template <template <int, class> class Kind, int Dim>
Kind<Dim, Lanes> gather_lanes(const Kind<Dim, double> (&values)[lane_count]) {
  constexpr int n = sizeof(Kind<Dim, double>) / sizeof(double);
  Kind<Dim, Lanes> all;
  for (int i = 0; i < n; ++i)
    for (int lane = 0; lane < lane_count; ++lane) all.c[i][lane] = values[lane].c[i];
  return all;
}

}  // namespace cairn::test
