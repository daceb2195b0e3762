#pragma once
/// A rigid body: it moves as prescribed, is never stressed, and counts as infinitely heavy in contact
/// (Nairn 2013, eqs. 13-16).

#include <array>

#include "cairn/material/elastic_moduli.hpp"

namespace cairn {

struct Rigid {
  static constexpr std::string_view name = "rigid";
  static constexpr std::array<Parameter, 0> parameters = {};
  static constexpr std::array<std::string_view, 0> state_names = {};
  static constexpr bool rigid = true;

  explicit Rigid(const ParameterValues& /*values*/) {}

  template <int Dim, class T>
  T update(const Tensor<Dim, T>& /*A*/, const Tensor<Dim, T>& /*F*/, T /*J*/, Symmetric<Dim, T>& /*stress*/,
           T* /*state*/) const {
    return T{};
  }
  template <int Dim>
  double strain_energy(const Tensor<Dim, double>& /*F*/, const double* /*state*/) const {
    return 0;
  }
  double plastic_work(const double* /*state*/) const { return 0; }
};

}  // namespace cairn
