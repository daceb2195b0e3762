#pragma once
/// The J-integral of a crack's tip and its stress intensities, as sums over material points (docs/cracks.md).
///
/// In axes of the tip, 1 ahead, with H = F - I, q falling from 1 to 0 between two radii, L the velocity gradient:
///   J_k = sum V [(sigma grad q) . H_k - (W + rho v^2/2) q_,k] + sum m q (a . H_k - v . L_k)
///   I_m = sum V [(sigma grad q) . H^m_1 + (sigma^m grad q) . H_1 - sigma^m : H q_,1] + sum m q a . H^m_1
/// with the field of Williams (J. Appl. Mech. 24, 1957) for a unit intensity of mode m; K_m = E'/2 I_m. The terms with
/// m are those of moving material (Nairn 2013; Guo & Nairn, CMES 6, 2004).
///
/// In 3D a tip is a point of the rim, and q has a hat along the rim as a factor; all sums are then divided by the
/// integral of q (1 . the rim's direction outwards) along it (Guo & Nairn, CMES 16, 2006). Where the rim is straight
/// within the hat the intensities are those of modes I, II and III; the axes do not turn with it elsewhere.

#include "cairn/core/types.hpp"

namespace cairn {

/// A crack's tip: where it is, the direction ahead, and the material there.
template <int Dim>
struct CrackTip {
  int crack = 0, end = 0;      // the first end or the last; in 3D the index of the rim's point
  Vec<Dim> position, ahead;    // [m], unit
  Vec<Dim> normal;             // in 3D, to what is above; in 2D above is left
  double hat = 0, weight = 1;  // in 3D: half the width of the hat, and the integral of q [m]
  double modulus = 0;          // E' = E, or E/(1 - nu^2) in plane strain [Pa]; 0: no stress intensities
  double kappa = 0;            // 3 - 4 nu, or (3 - nu)/(1 + nu) in plane stress
  double shear_modulus = 0;    // [Pa]
};

/// A material point as the integral sees it.
template <int Dim>
struct TipPoint {
  Vec<Dim> position, velocity, acceleration;
  Eigen::Matrix<double, Dim, Dim> stress, H, L;  // Cauchy stress [Pa], displacement and velocity gradients
  double energy = 0;                             // strain energy density [J/m3]
  double volume = 0, density = 0;
};

/// Sums over points.
struct TipSums {
  double J = 0, J_static = 0, I_opening = 0, I_sliding = 0;
  double I_tearing = 0;  // 3D
  static constexpr int size = 5;
  bool operator==(const TipSums&) const = default;
  void add(const TipSums& more) {
    J += more.J, J_static += more.J_static;
    I_opening += more.I_opening, I_sliding += more.I_sliding, I_tearing += more.I_tearing;
  }
};

/// q at a place.
template <int Dim>
double tip_weight(const CrackTip<Dim>& tip, const Vec<Dim>& x, double inner, double outer);

/// int q/sqrt(2 pi r) dr along a face, by which a traction on both faces that is the same all along counts [m^(1/2)].
double face_weight(double inner, double outer);

/// What a force on the upper face [N] at x, and its opposite on the lower one, adds. With a traction t on the upper
/// face, I_m + int q (t . e_m) 4/(E' sqrt(2 pi r)) ds, e the normal for opening, ahead for sliding; in 3D for tearing
/// 1/mu in the place of 1/E', and e the third axis. Nodes near the tip pass on the stress of what is ahead of it as
/// well, so t is the mean of forces from 1.25 to 4.25 cells behind the tip, by a smooth window. \param h  [m]  \param
/// weight  face_weight
template <int Dim>
TipSums face_terms(const CrackTip<Dim>& tip, const Vec<Dim>& x, const Vec<Dim>& force, double h, double weight);

/// The direction of the largest hoop stress [rad] from the one ahead, and the stress intensity there (Erdogan & Sih, J.
/// Basic Eng. 85, 1963).
struct HoopStress {
  double angle, intensity;
};
HoopStress largest_hoop_stress(double K_opening, double K_sliding);

/// What a point adds. \param inner, outer  radii between which q falls [m]
template <int Dim>
TipSums tip_terms(const CrackTip<Dim>& tip, const TipPoint<Dim>& point, double inner, double outer);

/// Displacement gradient and stress of a unit stress intensity (mode 0: opening, 1: sliding) at x from the tip, in its
/// axes.
struct UnitField {
  Eigen::Matrix2d H, stress;
};
UnitField unit_field(int mode, const Vec<2>& x, double shear_modulus, double kappa);

/// The same in 3D with modes I, II and III, in plane strain; the third axis is ahead x normal.
struct UnitField3D {
  Eigen::Matrix3d H, stress;
};
UnitField3D unit_field_3d(int mode, const Vec<2>& x, double shear_modulus, double kappa);

}  // namespace cairn
