#pragma once
/// The J-integral of a crack's tip and its stress intensities, as sums over material points (docs/cracks.md). 2D.
///
/// In axes of the tip, 1 ahead, with H = F - I, q falling from 1 to 0 between two radii, L the velocity gradient:
///   J_k = sum V [(sigma grad q) . H_k - (W + rho v^2/2) q_,k] + sum m q (a . H_k - v . L_k)
///   I_m = sum V [(sigma grad q) . H^m_1 + (sigma^m grad q) . H_1 - sigma^m : H q_,1] + sum m q a . H^m_1
/// with the field of Williams (J. Appl. Mech. 24, 1957) for a unit intensity of mode m; K_m = E'/2 I_m. The terms with
/// m are those of moving material (Nairn 2013; Guo & Nairn, CMES 6, 2004).

#include "cairn/core/types.hpp"

namespace cairn {

/// A crack's tip: where it is, the direction ahead, and the material there.
struct CrackTip {
  int crack = 0, end = 0;    // the first end or the last
  Vec<2> position, ahead;    // [m], unit
  double modulus = 0;        // E' = E, or E/(1 - nu^2) in plane strain [Pa]; 0: no stress intensities
  double kappa = 0;          // 3 - 4 nu, or (3 - nu)/(1 + nu) in plane stress
  double shear_modulus = 0;  // [Pa]
};

/// A material point as the integral sees it.
struct TipPoint {
  Vec<2> position, velocity, acceleration;
  Eigen::Matrix2d stress, H, L;  // Cauchy stress [Pa], displacement and velocity gradients
  double energy = 0;             // strain energy density [J/m3]
  double volume = 0, density = 0;
};

/// Sums over points.
struct TipSums {
  double J = 0, J_static = 0, I_opening = 0, I_sliding = 0;
  static constexpr int size = 4;
};

/// What a force on the upper face [N] adds, and its opposite on the lower one, within half of `width` [m] of x: with
/// t on the upper face, I_m + int q (t . e_m) 4/(E' sqrt(2 pi r)) ds, e the normal for opening, ahead for sliding.
TipSums face_terms(const CrackTip& tip, const Vec<2>& x, const Vec<2>& force, double width, double inner, double outer);

/// The direction of the largest hoop stress [rad] from the one ahead, and the stress intensity there (Erdogan & Sih, J.
/// Basic Eng. 85, 1963).
struct HoopStress {
  double angle, intensity;
};
HoopStress largest_hoop_stress(double K_opening, double K_sliding);

/// What a point adds. \param inner, outer  radii between which q falls [m]
TipSums tip_terms(const CrackTip& tip, const TipPoint& point, double inner, double outer);

/// Displacement gradient and stress of a unit stress intensity (mode 0: opening, 1: sliding) at x from the tip, in its
/// axes.
struct UnitField {
  Eigen::Matrix2d H, stress;
};
UnitField unit_field(int mode, const Vec<2>& x, double shear_modulus, double kappa);

}  // namespace cairn
