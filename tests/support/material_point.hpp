#pragma once
/// One material point under a law, advanced as a step advances it.

#include "cairn/material/registry.hpp"
#include "tensors.hpp"

namespace cairn::test {

template <int Dim, class ConcreteLaw>
struct MaterialPoint {
  ConcreteLaw law;
  Mat3 F = Mat3::Identity(), stress = Mat3::Zero();
  double state[state_capacity] = {};

  /// Advances the point by A = dt L, in `dt` seconds. Returns what the law returns.
  double advance(const Mat3& A, double dt = 0) {
    auto F_now = tensor<Dim>(F);
    auto s = symmetric<Dim>(stress);
    const double modulus = advance_point(law_of_step(law, dt), tensor<Dim>(A), F_now, s, state);
    F = matrix(F_now), stress = matrix(s);
    return modulus;
  }

  /// The same in plane strain, and with a J that is not that of F: 1 for closed forms of small strains.
  double advance_at(const Mat3& A, double J) {
    const auto F_now = advance_deformation(tensor<Dim>(A), tensor<Dim>(F));
    auto s = symmetric<Dim>(stress);
    const double modulus = law.update(tensor<Dim>(A), F_now, J, s, state);
    F = matrix(F_now), stress = matrix(s);
    return modulus;
  }

  double strain_energy() const { return law.strain_energy(tensor<Dim>(F), state); }
};

/// The cross-product matrix of a vector.
inline Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

inline Mat3 deviator(const Mat3& s) { return s - s.trace() / 3 * Mat3::Identity(); }

}  // namespace cairn::test
