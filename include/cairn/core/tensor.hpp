#pragma once
/// Second-order tensors of a material point. Always three-dimensional in meaning; in 2D (plane strain) the components
/// that vanish are not stored: a tensor has xx xy yx yy zz, a symmetric one xx yy zz xy.
/// `T` is double or Lanes (eight points at once).

#include "cairn/core/lanes.hpp"

namespace cairn {

/// Number of components stored.
template <int Dim>
inline constexpr int tensor_size = Dim == 2 ? 5 : 9;
template <int Dim>
inline constexpr int symmetric_size = Dim == 2 ? 4 : 6;

/// General tensor; 3D order: xx xy xz yx yy yz zx zy zz.
template <int Dim, class T>
struct Tensor {
  T c[tensor_size<Dim>];
};

/// Symmetric tensor; 3D order: xx yy zz xy yz xz.
template <int Dim, class T>
struct Symmetric {
  T c[symmetric_size<Dim>];
};

/// Position of component (i, j) in a stored tensor; in 2D only i, j < 2 or i = j = 2.
template <int Dim>
constexpr int tensor_index(int i, int j) {
  return Dim == 3 ? 3 * i + j : (i == 2 ? 4 : 2 * i + j);
}
template <int Dim>
constexpr int symmetric_index(int i, int j) {
  return i == j ? i : (i + j == 1 ? 3 : (i + j == 3 ? 4 : 5));
}

template <int Dim, class T>
Tensor<Dim, T> operator*(const Tensor<Dim, T>& a, const Tensor<Dim, T>& b) {
  Tensor<Dim, T> r;
  for (int i = 0; i < Dim; ++i)
    for (int j = 0; j < Dim; ++j) {
      T sum = a.c[tensor_index<Dim>(i, 0)] * b.c[tensor_index<Dim>(0, j)];
      for (int k = 1; k < Dim; ++k) sum += a.c[tensor_index<Dim>(i, k)] * b.c[tensor_index<Dim>(k, j)];
      r.c[tensor_index<Dim>(i, j)] = sum;
    }
  if constexpr (Dim == 2) r.c[4] = a.c[4] * b.c[4];
  return r;
}

template <int Dim, class T>
T determinant(const Tensor<Dim, T>& a) {
  const auto& c = a.c;
  if constexpr (Dim == 2)
    return (c[0] * c[3] - c[1] * c[2]) * c[4];
  else
    return c[0] * (c[4] * c[8] - c[5] * c[7]) - c[1] * (c[3] * c[8] - c[5] * c[6]) + c[2] * (c[3] * c[7] - c[4] * c[6]);
}

/// F F^T.
template <int Dim, class T>
Symmetric<Dim, T> left_cauchy_green(const Tensor<Dim, T>& F) {
  Symmetric<Dim, T> b;
  for (int i = 0; i < Dim; ++i)
    for (int j = i; j < Dim; ++j) {
      T sum = F.c[tensor_index<Dim>(i, 0)] * F.c[tensor_index<Dim>(j, 0)];
      for (int k = 1; k < Dim; ++k) sum += F.c[tensor_index<Dim>(i, k)] * F.c[tensor_index<Dim>(j, k)];
      b.c[symmetric_index<Dim>(i, j)] = sum;
    }
  if constexpr (Dim == 2) b.c[2] = F.c[4] * F.c[4];
  return b;
}

template <int Dim, class T>
Symmetric<Dim, T> symmetric_part(const Tensor<Dim, T>& a) {
  Symmetric<Dim, T> s;
  for (int i = 0; i < 3; ++i) s.c[i] = a.c[tensor_index<Dim>(i, i)];
  s.c[3] = 0.5 * (a.c[tensor_index<Dim>(0, 1)] + a.c[tensor_index<Dim>(1, 0)]);
  if constexpr (Dim == 3) {
    s.c[4] = 0.5 * (a.c[5] + a.c[7]);
    s.c[5] = 0.5 * (a.c[2] + a.c[6]);
  }
  return s;
}

template <int Dim, class T>
T trace(const Symmetric<Dim, T>& s) {
  return s.c[0] + s.c[1] + s.c[2];
}

/// a : b
template <int Dim, class T>
T contraction(const Symmetric<Dim, T>& a, const Symmetric<Dim, T>& b) {
  T shear = a.c[3] * b.c[3];
  if constexpr (Dim == 3) shear += a.c[4] * b.c[4] + a.c[5] * b.c[5];
  return a.c[0] * b.c[0] + a.c[1] * b.c[1] + a.c[2] * b.c[2] + 2.0 * shear;
}

/// scale a + diagonal I
template <int Dim, class T>
Symmetric<Dim, T> scale_and_shift(const Symmetric<Dim, T>& a, T scale, T diagonal) {
  Symmetric<Dim, T> r;
  for (int i = 0; i < symmetric_size<Dim>; ++i) r.c[i] = scale * a.c[i];
  for (int i = 0; i < 3; ++i) r.c[i] += diagonal;
  return r;
}

/// F <- (I + A + A^2/2 + A^3/8) F: exp(A) to second order in A = dt L. With 1/8 for the third order a rotation by t
/// stretches by t^6/128 alone (with 1/6 it shrinks by t^4/24, without it stretches by t^4/8): a body that turns for
/// long keeps its volume. The out-of-plane component in 2D, which does not turn, is 1 + a + a^2/2.
template <int Dim, class T>
Tensor<Dim, T> advance_deformation(const Tensor<Dim, T>& A, const Tensor<Dim, T>& F) {
  const Tensor<Dim, T> square = A * A, cube = square * A;
  Tensor<Dim, T> increment;
  for (int i = 0; i < Dim * Dim; ++i) increment.c[i] = A.c[i] + 0.5 * square.c[i] + 0.125 * cube.c[i];
  if constexpr (Dim == 2) increment.c[4] = A.c[4] + 0.5 * square.c[4];
  Tensor<Dim, T> result = increment * F;
  for (int i = 0; i < tensor_size<Dim>; ++i) result.c[i] += F.c[i];
  return result;
}

/// R s R^T with the rotation R = (I - W/2)^-1 (I + W/2) of the spin increment W = skew(A) (Hughes & Winget 1980):
/// exactly orthogonal, so that the norm of a stress carried round never grows.
template <int Dim, class T>
Symmetric<Dim, T> rotate_by_spin(const Tensor<Dim, T>& A, const Symmetric<Dim, T>& s) {
  if constexpr (Dim == 2) {
    const T half = 0.25 * (A.c[2] - A.c[1]);  // half the rotation's rate about z times dt, over 2
    const T scale = 1.0 / (1.0 + half * half);
    const T cosine = (1.0 - half * half) * scale, sine = 2.0 * half * scale;
    const T mean = 0.5 * (s.c[0] + s.c[1]), difference = 0.5 * (s.c[0] - s.c[1]);
    const T cosine2 = cosine * cosine - sine * sine, sine2 = 2.0 * sine * cosine;
    const T turned = difference * cosine2 - s.c[3] * sine2;
    return {{mean + turned, mean - turned, s.c[2], difference * sine2 + s.c[3] * cosine2}};
  } else {
    const T a[3] = {0.25 * (A.c[7] - A.c[5]), 0.25 * (A.c[2] - A.c[6]), 0.25 * (A.c[3] - A.c[1])};
    const T scale = 2.0 / (1.0 + a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    Tensor<3, T> R;  // I + 2/(1+a.a) (a^ + a^ a^), a^ the cross-product matrix of a
    R.c[0] = 1.0 - scale * (a[1] * a[1] + a[2] * a[2]);
    R.c[4] = 1.0 - scale * (a[0] * a[0] + a[2] * a[2]);
    R.c[8] = 1.0 - scale * (a[0] * a[0] + a[1] * a[1]);
    R.c[1] = scale * (a[0] * a[1] - a[2]);
    R.c[3] = scale * (a[0] * a[1] + a[2]);
    R.c[2] = scale * (a[0] * a[2] + a[1]);
    R.c[6] = scale * (a[0] * a[2] - a[1]);
    R.c[5] = scale * (a[1] * a[2] - a[0]);
    R.c[7] = scale * (a[1] * a[2] + a[0]);
    const Tensor<3, T> full = {{s.c[0], s.c[3], s.c[5], s.c[3], s.c[1], s.c[4], s.c[5], s.c[4], s.c[2]}};
    const Tensor<3, T> Rs = R * full;
    Symmetric<3, T> result;
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j)
        result.c[symmetric_index<3>(i, j)] =
            Rs.c[3 * i] * R.c[3 * j] + Rs.c[3 * i + 1] * R.c[3 * j + 1] + Rs.c[3 * i + 2] * R.c[3 * j + 2];
    return result;
  }
}

}  // namespace cairn
