#pragma once
/// The two moduli that every isotropic law here starts from, and the update that the rate forms share.

#include <cmath>

#include "cairn/core/options.hpp"
#include "cairn/core/tensor.hpp"
#include "cairn/material/parameters.hpp"

namespace cairn {

inline constexpr Parameter shear_modulus_parameter{"shear_modulus", "Pa", "shear modulus G"};
inline constexpr Parameter bulk_modulus_parameter{"bulk_modulus", "Pa", "bulk modulus K"};

/// Newton's iterations for the out-of-plane increment in plane stress; always as many, so that a point's bits do not
/// depend on those beside it. Enough for round-off in steps of up to 10 % strain, far beyond what a time step allows.
inline constexpr int plane_stress_iterations = 8;

struct ElasticModuli {
  double shear, bulk;  // [Pa]
  explicit ElasticModuli(const ParameterValues& values)
      : shear(values.at("shear_modulus")), bulk(values.at("bulk_modulus")) {}
  /// Longitudinal modulus K + 4G/3 [Pa].
  double longitudinal() const { return bulk + 4.0 / 3.0 * shear; }

  /// Objective elastic predictor: R sigma R^T + K tr(D) I + 2 G dev(D), A = dt L, D = sym(A) (Hughes & Winget 1980).
  template <int Dim, class T>
  Symmetric<Dim, T> predict(const Tensor<Dim, T>& A, const Symmetric<Dim, T>& D,
                            const Symmetric<Dim, T>& stress) const {
    Symmetric<Dim, T> s = rotate_by_spin(A, stress);
    const T spherical = (bulk - 2.0 / 3.0 * shear) * trace(D);
    for (int i = 0; i < symmetric_size<Dim>; ++i) s.c[i] += 2.0 * shear * D.c[i];
    for (int i = 0; i < 3; ++i) s.c[i] += spherical;
    return s;
  }

  /// Plane stress of the predictor: the increment A_zz for which its zz component vanishes; `sigma_zz` is the old one.
  template <class T>
  T out_of_plane(const Tensor<2, T>& A, T sigma_zz) const {
    return -((bulk - 2.0 / 3.0 * shear) * (A.c[0] + A.c[3]) + sigma_zz) * (1.0 / longitudinal());
  }

  /// det F under a pressure [Pa] that the rate form has built up from none, sigma = K ln(det F) I.
  double volume_ratio(double pressure) const { return std::exp(-pressure / bulk); }
  /// The stress power summed on the way there, per reference volume [J/m3].
  double hydrostatic_work(double pressure) const {
    const double strain = -pressure / bulk;
    return bulk * (strain * std::exp(strain) - std::expm1(strain));
  }
};

}  // namespace cairn
