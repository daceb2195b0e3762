#pragma once
/// Hypoelastic solid: an isotropic linear relation between the objective stress rate and the rate of deformation,
/// integrated by the incrementally objective update of Hughes & Winget (1980). Its strain energy is the stress power,
/// sum J sigma : D dt, since no potential belongs to this law.

#include <array>

#include "cairn/material/elastic_moduli.hpp"

namespace cairn {

struct Hypoelastic {
  static constexpr std::string_view name = "hypoelastic";
  static constexpr std::array parameters = {shear_modulus_parameter, bulk_modulus_parameter};
  static constexpr std::array<std::string_view, 1> state_names = {"stress_work"};
  static constexpr bool rigid = false;

  ElasticModuli moduli;
  Plane plane = Plane::strain;
  explicit Hypoelastic(const ParameterValues& values) : moduli(values) {}

  /// New stress [Pa] from A = dt L; state: stress work per reference volume [J/m3].
  template <int Dim, class T>
  T update(const Tensor<Dim, T>& A, const Tensor<Dim, T>& /*F*/, T J, Symmetric<Dim, T>& stress, T* state) const {
    const Symmetric<Dim, T> D = symmetric_part(A), old = stress;
    stress = moduli.predict(A, D, old);
    state[0] += 0.5 * J * (contraction(old, D) + contraction(stress, D));
    return J * moduli.longitudinal();
  }

  /// Plane stress: the increment A_zz for which the new sigma_zz vanishes.
  template <class T>
  T out_of_plane(const Tensor<2, T>& A, const Tensor<2, T>& /*F*/, const Symmetric<2, T>& stress,
                 const T* /*state*/) const {
    return moduli.out_of_plane(A, stress.c[2]);
  }

  /// Sets the state of a body under hydrostatic pressure [Pa] and returns its det F.
  double pressurise(double pressure, double* state) const {
    state[0] = moduli.hydrostatic_work(pressure);
    return moduli.volume_ratio(pressure);
  }

  template <int Dim>
  double strain_energy(const Tensor<Dim, double>& /*F*/, const double* state) const {
    return state[0];
  }
  double plastic_work(const double* /*state*/) const { return 0; }
};

}  // namespace cairn
