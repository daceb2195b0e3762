#pragma once
/// Laws of imperfect interfaces and cohesive zones: tractions T between the faces of a crack from its opening, at crack
/// points (docs/cracks.md). d[0] is the opening along the normal, negative where faces overlap, d[1] the slip [m].
///
/// Interface (Nairn, CMES 92, 2013): T = D d. Cohesive (Nairn 2013, section 2.8): in each mode, with the largest
/// opening d_m so far, T = T(d_m) d/d_m, back to the origin; no normal traction where the faces are closed. It breaks
/// for good where d_m reaches the critical opening in a mode or, with an exponent n, where
///   (G_n/G_nc)^n + (G_t/G_tc)^n >= 1,    G = int_0^d_m T(d) dd.
/// Energies per area: stored T d/2 in each mode; dissipated G - T(d_m) d_m/2, and what was stored when it broke.

#include <array>
#include <cmath>
#include <variant>

#include "cairn/body/crack_point.hpp"
#include "cairn/crack/options.hpp"

namespace cairn {

/// T rises to the strength S at the opening k d_c, falls to 0 at d_c; G_c = S d_c/2.
struct TriangleLaw {
  double strength, critical, at_peak;
  double traction(double d) const {
    if (d <= at_peak) return strength * d / at_peak;
    return d < critical ? strength * (critical - d) / (critical - at_peak) : 0.0;
  }
  double area(double d) const {
    if (d <= at_peak) return 0.5 * traction(d) * d;
    const double left = std::max(0.0, critical - d);
    return 0.5 * strength * (critical - left * left / (critical - at_peak));
  }
  double stiffness() const { return strength / at_peak; }
};

/// T = S d/d_c up to d_c, where it breaks; G_c = S d_c/2.
struct BrittleLaw {
  double strength, critical;
  double traction(double d) const { return strength * std::min(1.0, d / critical); }
  double area(double d) const { return 0.5 * traction(d) * std::min(d, critical); }
  double stiffness() const { return strength / critical; }
};

/// T = S (d/d_0) exp(1 - d/d_0); G_c = e S d_0, of which .3 % are left where it breaks, at 8 d_0.
struct ExponentialLaw {
  double strength, scale, critical;
  double traction(double d) const { return strength * d / scale * std::exp(1 - d / scale); }
  double area(double d) const {
    return std::exp(1.0) * strength * scale * (1 - (1 + d / scale) * std::exp(-d / scale));
  }
  double stiffness() const { return std::exp(1.0) * strength / scale; }
};

using CohesiveMode = std::variant<TriangleLaw, BrittleLaw, ExponentialLaw>;
CohesiveMode make_cohesive_mode(const CohesiveSpec& spec, int mode);

/// What passes between a crack's faces besides contact.
class TractionLaw {
 public:
  using Modes = std::array<double, 2>;  // of opening and of slip

  explicit TractionLaw(const InterfaceSpec& spec);
  explicit TractionLaw(const CohesiveSpec& spec);

  /// Tractions that close the crack and that act against the slip [Pa].
  Modes traction(const Modes& d, const Bond& bond) const;
  /// Takes note of an opening; the same opening twice changes nothing.
  void follow(const Modes& d, Bond& bond) const;
  double stored(const Modes& d, const Bond& bond) const;  // [J/m2]
  double dissipated(const Bond& bond) const;              // [J/m2]
  double largest_stiffness() const;                       // [Pa/m]

 private:
  bool breaks(const Bond& bond) const;
  double dissipated_unbroken(const Bond& bond) const;

  bool cohesive_ = false;
  Modes opening_{}, closing_{};  // of an interface, stiffness by mode [Pa/m]; 0 where it is perfect
  std::array<CohesiveMode, 2> modes_;
  Modes energy_{};  // G_c [J/m2]
  double exponent_ = 0;
};

}  // namespace cairn
