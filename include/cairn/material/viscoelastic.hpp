#pragma once
/// Viscoelastic solid: a generalised Maxwell model (Prony series) of the deviator at finite strain. A neo-Hookean solid
/// with the long-term shear modulus stands beside 1 to 4 Maxwell branches of modulus G_i and relaxation time tau_i,
/// each with a deviatoric Kirchhoff overstress h_i that turns with the material:
///   J sigma = J sigma_neo_hookean + sum h_i,      dh_i/dt (corotational) = 2 G_i dev D - h_i / tau_i.
/// The convolution is integrated as in Simo & Hughes 1998, section 10.3, exactly for a constant rate D in a step and
/// hence stably for any dt / tau_i; the rotation is that of Hughes & Winget 1980. A branch stores h:h / (4 G_i) and
/// dissipates h:h / (2 G_i tau_i) >= 0, which add up to its stress power exactly.

#include <algorithm>
#include <array>
#include <string>

#include "cairn/material/neo_hookean.hpp"

namespace cairn {

inline constexpr int most_branches = 4;

/// Names of the state variables of `most_branches` branches.
inline constexpr std::array<std::string_view, 1 + 5 * most_branches> viscoelastic_state_names = {
    "viscous_dissipation",                                                                              //
    "overstress_1_xx",     "overstress_1_yy", "overstress_1_xy", "overstress_1_yz", "overstress_1_xz",  //
    "overstress_2_xx",     "overstress_2_yy", "overstress_2_xy", "overstress_2_yz", "overstress_2_xz",  //
    "overstress_3_xx",     "overstress_3_yy", "overstress_3_xy", "overstress_3_yz", "overstress_3_xz",  //
    "overstress_4_xx",     "overstress_4_yy", "overstress_4_xy", "overstress_4_yz", "overstress_4_xz"};

/// One type for each number of branches, so that points hold no more than they need.
template <int Branches>
struct Viscoelastic {
  static constexpr std::string_view name = "viscoelastic";
  static constexpr std::array parameters = {
      Parameter{"shear_modulus", "Pa", "long-term shear modulus G"}, bulk_modulus_parameter,
      Parameter{
          .key = "branch_moduli", .unit = "Pa", .meaning = "shear moduli G_i of the branches", .most = most_branches},
      Parameter{.key = "branch_times",
                .unit = "s",
                .meaning = "relaxation times tau_i of the branches",
                .most = most_branches,
                .as_many_as = "branch_moduli"}};
  static constexpr auto state_names = [] {
    std::array<std::string_view, 1 + 5 * Branches> names;
    std::copy_n(viscoelastic_state_names.begin(), names.size(), names.begin());
    return names;
  }();
  static constexpr bool rigid = false;

  /// One branch, and what a step makes of it: h <- decay R h R^T + gain dev D dt; the dissipation is a quadratic form
  /// in the rotated h and the increment dev D dt.
  struct Branch {
    double shear = 0, time = 0;  // [Pa], [s]
    double decay = 1, gain = 2 * shear;
    double old_old = 0, old_new = 0, new_new = 0;
  };

  NeoHookean solid;
  std::array<Branch, Branches> branches;
  double shear_sum = 0;  // of the branches [Pa]
  Plane plane = Plane::strain;

  explicit Viscoelastic(const ParameterValues& values) : solid(values) {
    for (int i = 0; i < Branches; ++i) {
      branches[i] = {values.at(list_key("branch_moduli", i)), values.at(list_key("branch_times", i))};
      shear_sum += branches[i].shear;
    }
  }
  /// Whether the values are those of so many branches.
  static bool fits(const ParameterValues& values) {
    return values.contains(list_key("branch_moduli", Branches - 1)) &&
           !values.contains(list_key("branch_moduli", Branches));
  }

  /// The law with the coefficients of a step of `dt` seconds.
  Viscoelastic of_step(double dt) const {
    Viscoelastic law = *this;
    for (Branch& b : law.branches) {
      const double x = dt / b.time, lost = -std::expm1(-x);  // 1 - exp(-x)
      const double mean = x > 0 ? lost / x : 1.0;
      b.decay = 1.0 - lost;
      b.gain = 2.0 * b.shear * mean;
      // x times the integrals of e^(-2xs), e^(-xs) (1 - e^(-xs))/x and ((1 - e^(-xs))/x)^2 over s from 0 to 1; the last
      // by its series where the closed form cancels.
      b.old_old = 0.5 * lost * (1.0 + b.decay) / (2.0 * b.shear);
      b.old_new = mean * lost;
      const double square = x < 0.02 ? x * (1.0 / 3 - x * (1.0 / 4 - x * (7.0 / 60 - x * (1.0 / 24 - x * 31.0 / 2520))))
                                     : (1.0 - mean * (2.0 - 0.5 * (1.0 + b.decay))) / x;
      b.new_new = square * 2.0 * b.shear;
    }
    return law;
  }

  /// New stress [Pa]; state: viscous dissipation per reference volume [J/m3], overstresses [Pa].
  template <int Dim, class T>
  T update(const Tensor<Dim, T>& A, const Tensor<Dim, T>& F, T J, Symmetric<Dim, T>& stress, T* state) const {
    const T modulus = solid.update(A, F, J, stress, state);
    const Symmetric<Dim, T> D = symmetric_part(A);
    const Symmetric<Dim, T> increment = scale_and_shift(D, T{} + 1.0, trace(D) * (-1.0 / 3.0));
    const T squared = contraction(increment, increment), inverse = 1.0 / J;
    for (int b = 0; b < Branches; ++b) {
      const Branch& branch = branches[b];
      Symmetric<Dim, T> h = rotate_by_spin(A, overstress<Dim>(state, b));
      state[0] +=
          branch.old_old * contraction(h, h) + branch.old_new * contraction(h, increment) + branch.new_new * squared;
      for (int i = 0; i < symmetric_size<Dim>; ++i) {
        h.c[i] = branch.decay * h.c[i] + branch.gain * increment.c[i];
        stress.c[i] += inverse * h.c[i];
        if (i != 2) state[column(b, i)] = h.c[i];
      }
    }
    return modulus + 4.0 / 3.0 * shear_sum;
  }

  /// Plane stress: the increment A_zz for which the new sigma_zz vanishes.
  template <class T>
  T out_of_plane(const Tensor<2, T>& A, const Tensor<2, T>& F, const Symmetric<2, T>& /*stress*/,
                 const T* state) const {
    T extra{};
    double slope = 0;
    for (int b = 0; b < Branches; ++b) {
      extra += branches[b].decay * overstress<2>(state, b).c[2] - branches[b].gain * (1.0 / 3.0) * (A.c[0] + A.c[3]);
      slope += 2.0 / 3.0 * branches[b].gain;
    }
    return solid.out_of_plane(A, F, extra, slope);
  }

  /// det F of a body under hydrostatic pressure [Pa]: the branches carry none of it.
  double pressurise(double pressure, double* state) const { return solid.pressurise(pressure, state); }

  /// Strain energy of the solid and the branches per reference volume [J/m3].
  template <int Dim>
  double strain_energy(const Tensor<Dim, double>& F, const double* state) const {
    double sum = solid.strain_energy(F, state);
    for (int b = 0; b < Branches; ++b) {
      const auto h = overstress<Dim>(state, b);
      sum += contraction(h, h) / (4.0 * branches[b].shear);
    }
    return sum;
  }
  double plastic_work(const double* /*state*/) const { return 0; }
  double viscous_dissipation(const double* state) const { return state[0]; }

 private:
  /// Where component i of a branch's overstress (not zz, which the others give) lies in the state.
  static constexpr int column(int branch, int i) { return 1 + 5 * branch + (i < 2 ? i : i - 1); }

  template <int Dim, class T>
  static Symmetric<Dim, T> overstress(const T* state, int branch) {
    Symmetric<Dim, T> h;
    for (int i = 0; i < symmetric_size<Dim>; ++i)
      if (i != 2) h.c[i] = state[column(branch, i)];
    h.c[2] = -(h.c[0] + h.c[1]);
    return h;
  }
};

}  // namespace cairn
