#pragma once
/// The two moduli that every isotropic law here starts from, and the update that the rate forms share.

#include "cairn/core/tensor.hpp"
#include "cairn/material/parameters.hpp"

namespace cairn {

inline constexpr Parameter shear_modulus_parameter{"shear_modulus", "Pa", "shear modulus G"};
inline constexpr Parameter bulk_modulus_parameter{"bulk_modulus", "Pa", "bulk modulus K"};

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
};

}  // namespace cairn
