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
  Plane plane = Plane::strain;
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

  /// Plane stress: the increment A_zz for which the new sigma_zz vanishes.
  template <class T>
  T out_of_plane(const Tensor<2, T>& A, const Tensor<2, T>& F, const Symmetric<2, T>& /*stress*/,
                 const T* /*state*/) const {
    return out_of_plane(A, F, T{}, 0.0);
  }
  /// The same where J sigma_zz has a further part `extra` + `slope` A_zz [Pa], as an overstress. With u = l^(2/3), l
  /// the new out-of-plane stretch, j and t the in-plane parts of det F and tr b, the root is that of the quartic
  ///   u J sigma_zz = K/2 (j^2 u^4 - u) + G/3 j^(-2/3) (2 u^3 - t) + u (extra + slope A_zz),
  /// convex without the last term: Newton's iteration from u >= j^(-2/3) finds it from any deformation.
  template <class T>
  T out_of_plane(const Tensor<2, T>& A, const Tensor<2, T>& F, T extra, double slope) const {
    const Tensor<2, T> flat = advance_deformation(A, F);  // with A_zz = 0
    const T j = flat.c[0] * flat.c[3] - flat.c[1] * flat.c[2];
    const T root = inverse_cube_root(j), scale = root * root, inverse = 1.0 / F.c[4];
    const T t = flat.c[0] * flat.c[0] + flat.c[1] * flat.c[1] + flat.c[2] * flat.c[2] + flat.c[3] * flat.c[3];
    const T quartic = 0.5 * moduli.bulk * j * j, cubic = 2.0 / 3.0 * moduli.shear * scale;
    const T linear = extra - 0.5 * moduli.bulk, constant = -0.5 * cubic * t;
    const T old_root = inverse_cube_root(F.c[4]);
    T u = maximum(1.0 / (old_root * old_root), scale), a{};
    for (int i = 0; i <= plane_stress_iterations; ++i) {
      // l / l_old = 1 + a + a^2/2, as advance_deformation has it
      const T half = square_root(u), one_and_a = square_root(maximum(2.0 * u * half * inverse - 1.0, T{} + 0.01));
      a = one_and_a - 1.0;
      const T with_a = linear + slope * a;
      const T value = ((quartic * u + cubic) * (u * u) + with_a) * u + constant;
      const T gradient =
          (4.0 * quartic * u + 3.0 * cubic) * (u * u) + with_a + slope * 1.5 * u * half * inverse / one_and_a;
      if (i < plane_stress_iterations) u -= value / gradient;
    }
    return a;
  }

  /// det F of a body under hydrostatic pressure [Pa], from K/2 (J - 1/J) = -p.
  double pressurise(double pressure, double* /*state*/) const {
    const double ratio = pressure / moduli.bulk;
    return std::sqrt(1.0 + ratio * ratio) - ratio;
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
