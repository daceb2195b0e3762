#pragma once
/// Compressible neo-Hookean solid of Bardenhagen et al. 2001 (Simo & Hughes):
///   W     = K/2 [(J^2 - 1)/2 - ln J] + G/2 (tr b_bar - 3)         per reference volume, b_bar = J^(-2/3) F F^T
///   sigma = K/2 (J - 1/J) I + (G/J) dev b_bar

#include <array>

#include "cairn/material/elastic_moduli.hpp"

namespace cairn {

struct NeoHookean {
  static constexpr std::string_view name = "neo_hookean";
  static constexpr std::array parameters = {shear_modulus_parameter, bulk_modulus_parameter};
  static constexpr std::array<std::string_view, 0> state_names = {};
  static constexpr bool rigid = false;

  ElasticModuli moduli;
  explicit NeoHookean(const ParameterValues& values) : moduli(values) {}

  /// New stress [Pa] from the new deformation gradient `F` with determinant `J`.
  /// Returns the longitudinal modulus times the reference density over the current one [Pa], for the time step: exact
  /// for pure changes of volume, within some per cent for large distortion.
  template <int Dim, class T>
  T update(const Tensor<Dim, T>& /*A*/, const Tensor<Dim, T>& F, T J, Symmetric<Dim, T>& stress, T* /*state*/) const {
    const T inverse = 1.0 / J, root = inverse_cube_root(J);
    const T scale = moduli.shear * inverse * (root * root);
    const Symmetric<Dim, T> b = left_cauchy_green(F);
    const T mean = trace(b) * (1.0 / 3.0);
    stress = scale_and_shift(b, scale, 0.5 * moduli.bulk * (J - inverse) - scale * mean);
    return J * (0.5 * moduli.bulk * (J + inverse) + 4.0 / 3.0 * scale * mean);
  }

  /// Strain energy per reference volume [J/m3].
  template <int Dim>
  double strain_energy(const Tensor<Dim, double>& F, const double* /*state*/) const {
    const double J = determinant(F), root = std::cbrt(J);
    return 0.5 * moduli.bulk * (0.5 * (J * J - 1) - std::log(J)) +
           0.5 * moduli.shear * (trace(left_cauchy_green(F)) / (root * root) - 3);
  }
  double plastic_work(const double* /*state*/) const { return 0; }
};

}  // namespace cairn
