#pragma once
/// What happens to material points under a law in one step, whatever the law.

#include "cairn/core/options.hpp"
#include "cairn/core/tensor.hpp"

namespace cairn {

/// The law can hold sigma_zz at zero.
template <class ConcreteLaw>
concept HasPlaneStress = requires(const ConcreteLaw& law, const Tensor<2, double>& A, const Symmetric<2, double>& s) {
  law.out_of_plane(A, A, s, static_cast<const double*>(nullptr));
};

/// The law can be given a hydrostatic pressure at the start.
template <class ConcreteLaw>
concept HasPressure = requires(const ConcreteLaw& law, double* state) {
  law.pressurise(0.0, state);
};

/// The law for a step of `dt` seconds: that of a rate-dependent law knows its coefficients, any other is returned.
template <class ConcreteLaw>
decltype(auto) law_of_step(const ConcreteLaw& law, double dt) {
  if constexpr (requires { law.of_step(dt); })
    return law.of_step(dt);
  else
    return (law);
}

/// Deformation gradient, stress and state after A = dt L. In plane stress A_zz, which the grid leaves open, is the one
/// that gives sigma_zz = 0. Returns the longitudinal modulus times the reference density over the current one [Pa].
template <int Dim, class T, class ConcreteLaw>
T advance_point(const ConcreteLaw& law, Tensor<Dim, T> A, Tensor<Dim, T>& F, Symmetric<Dim, T>& stress, T* state) {
  if constexpr (Dim == 2 && HasPlaneStress<ConcreteLaw>)
    if (law.plane == Plane::stress) A.c[4] = law.out_of_plane(A, F, stress, state);
  F = advance_deformation(A, F);
  return law.update(A, F, determinant(F), stress, state);
}

}  // namespace cairn
