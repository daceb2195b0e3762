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
  Plane plane = Plane::strain;
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

  /// Plane stress: the increment A_zz for which the new sigma_zz vanishes. With c the zz component of the predictor's
  /// deviator, sigma_zz is an increasing function of c: linear inside the yield surface; beyond it, concave for c > 0
  /// and odd. Newton's iteration from the elastic root, which lies on the side of zero, then never overshoots.
  template <class T>
  T out_of_plane(const Tensor<2, T>& A, const Tensor<2, T>& /*F*/, const Symmetric<2, T>& stress,
                 const T* state) const {
    const Symmetric<2, T> trial = moduli.predict(A, symmetric_part(A), stress);  // with A_zz = 0
    const T mean = trace(trial) * (1.0 / 3.0);
    const Symmetric<2, T> deviator = scale_and_shift(trial, T{} + 1.0, -mean);
    const T c0 = deviator.c[2];
    const T rest = 1.5 * contraction(deviator, deviator) - 2.25 * c0 * c0;  // the part of q^2 that A_zz does not change
    const T limit = yield_stress + hardening_modulus * state[0];
    const double ratio = 0.75 * moduli.bulk / moduli.shear;  // d mean / dc
    const double share = 3.0 * moduli.shear / (3.0 * moduli.shear + hardening_modulus);
    T c = c0 - (mean + c0) * (1.0 / (1.0 + ratio));
    for (int i = 0; i < plane_stress_iterations; ++i) {
      const T q = square_root(maximum(rest + 2.25 * c * c, T{} + 1e-300));
      const T yielded = limit / q;  // below 1 beyond the yield surface
      const T scale = 1.0 - share * maximum(1.0 - yielded, T{});
      const T slope = select(yielded < 1.0, share * 2.25 * c * c * yielded / (q * q), 0.0);
      c -= (mean + ratio * (c - c0) + scale * c) / (ratio + scale - slope);
    }
    return (c - c0) * (0.75 / moduli.shear);
  }

  /// Sets the state of a body under hydrostatic pressure [Pa] and returns its det F.
  double pressurise(double pressure, double* state) const {
    state[1] = moduli.hydrostatic_work(pressure);
    return moduli.volume_ratio(pressure);
  }

  template <int Dim>
  double strain_energy(const Tensor<Dim, double>& /*F*/, const double* state) const {
    return state[1] - state[2];
  }
  double plastic_work(const double* state) const { return state[2]; }
};

}  // namespace cairn
