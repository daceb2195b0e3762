#pragma once
/// Von Mises plasticity with linear isotropic hardening: objective elastic predictor (Hughes & Winget 1980), radial
/// return (Wilkins 1964; Simo & Hughes, box 3.1). Yield: sqrt(3/2) |dev sigma| <= yield_stress + hardening_modulus * e,
/// with e the equivalent plastic strain.

#include <array>

#include "cairn/material/elastic_moduli.hpp"

namespace cairn {

struct VonMises {
  static constexpr std::string_view name = "von_mises";
  static constexpr std::array parameters = {shear_modulus_parameter, bulk_modulus_parameter,
                                            Parameter{"yield_stress", "Pa", "initial yield stress in tension"},
                                            Parameter{.key = "hardening_modulus",
                                                      .unit = "Pa",
                                                      .meaning = "slope of yield stress over equivalent plastic strain",
                                                      .lower_allowed = true,
                                                      .fallback = 0.0}};
  static constexpr std::array<std::string_view, 3> state_names = {"plastic_strain", "stress_work", "plastic_work"};
  static constexpr bool rigid = false;

  ElasticModuli moduli;
  double yield_stress, hardening_modulus;  // [Pa]
  explicit VonMises(const ParameterValues& values)
      : moduli(values), yield_stress(values.at("yield_stress")), hardening_modulus(values.at("hardening_modulus")) {}

  /// New stress [Pa]; state: equivalent plastic strain [-], stress work and plastic work per reference volume [J/m3].
  template <int Dim, class T>
  T update(const Tensor<Dim, T>& A, const Tensor<Dim, T>& /*F*/, T J, Symmetric<Dim, T>& stress, T* state) const {
    const Symmetric<Dim, T> D = symmetric_part(A), old = stress;
    const Symmetric<Dim, T> trial = moduli.predict(A, D, old);
    const T mean = trace(trial) * (1.0 / 3.0);
    const Symmetric<Dim, T> deviator = scale_and_shift(trial, T{} + 1.0, -mean);
    const T equivalent = square_root(1.5 * contraction(deviator, deviator));
    const T excess = equivalent - (yield_stress + hardening_modulus * state[0]);
    const T strain = maximum(excess, T{}) * (1.0 / (3.0 * moduli.shear + hardening_modulus));
    const T scale = 1.0 - 3.0 * moduli.shear * strain / maximum(equivalent, T{} + 1e-300);
    stress = scale_and_shift(deviator, scale, mean);
    state[0] += strain;
    state[1] += 0.5 * J * (contraction(old, D) + contraction(stress, D));
    // The mean of the old and new yield stress: exact for radial loading.
    state[2] += J * strain * (yield_stress + hardening_modulus * (state[0] - 0.5 * strain));
    return J * moduli.longitudinal();
  }

  template <int Dim>
  double strain_energy(const Tensor<Dim, double>& /*F*/, const double* state) const {
    return state[1] - state[2];
  }
  double plastic_work(const double* state) const { return state[2]; }
};

}  // namespace cairn
