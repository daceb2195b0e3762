#pragma once
/// What a simulation is asked for, and what it tells: materials, sums over everything, where the stepping stands.

#include "cairn/body/patch.hpp"
#include "cairn/crack/j_integral.hpp"
#include "cairn/material/registry.hpp"

namespace cairn {

/// What the solver needs of a material.
struct SolverMaterial {
  std::string name;
  Law law;
  double density;  // [kg/m3]
  bool rigid = false;
  double longitudinal_modulus = 0;  // [Pa]
  std::vector<std::string_view> state_names;
};

/// Sums over all points and nodes, the same bits on any number of ranks (sums of patch sums in patch order), beside
/// those of the patches' ledgers.
struct Totals : PatchLedger {
  double kinetic = 0, strain = 0, potential = 0, plastic = 0;  // [J]; rigid bodies are left out
  double viscous = 0;                                          // [J], dissipated in the material; likewise
  double crack_energy = 0, crack_dissipation = 0;              // [J], stored and taken by laws between faces of cracks
  double numerical = 0;                                        // [J], lost by blending with PIC and in spins
  Vec3 momentum = Vec3::Zero();                                // [kg m/s]; rigid bodies are left out
  double mass = 0, deformable_mass = 0;                        // [kg]
  double deformable_volume = 0;                                // [m3], as it is now
  std::array<double, 6> stress{};                              // stress_of_points over the room between the faces [Pa]
  Eigen::Matrix3d velocity_gradient =
      Eigen::Matrix3d::Zero();  // L of v = v_0 + L x, fitted to deformable points by mass
  double energy() const {
    return kinetic + strain + potential + plastic + viscous + crack_energy + crack_dissipation + contact_dissipation +
           numerical + filtered + damped + energy_left - boundary_work;
  }
};

/// sqrt(2 D':D'), D' the deviator of the symmetric part; of simple shear its rate [1/s].
double shear_rate(const Eigen::Matrix3d& velocity_gradient, int dimension);

/// I = shear rate x d sqrt(rho/p) (GDR MiDi, Eur. Phys. J. E 14, 2004; da Cruz et al., Phys. Rev. E 72, 021309), with d
/// the diameter of a disk or ball of the bodies' mean volume, rho their density, p = -tr sigma / dimension; 0 where p
/// is not positive or no body is known to be there.
double inertial_number(const Totals& totals, std::int64_t bodies, int dimension);

/// Where the stepping stands: with the points, all that the next step depends on.
struct StepState {
  double time = 0, dt = 0;                 // dt: of the last step [s]
  double wave_speed = 0, point_speed = 0;  // largest over all points, for the next dt [m/s]
  std::int64_t steps = 0;
  std::array<double, 2> kinetic{};   // energy after the last two steps, while bodies relax [J]
  Vec3 upper = Vec3::Zero();         // corner of the domain, which may deform [m]
  Vec3 needed_rates = Vec3::Zero();  // at which a domain that deforms holds its stresses [1/s]
};

/// What ranks tell each other along with the speeds; the largest of each counts. It costs no communication of its own.
struct Notice {
  double stop = 0;  // a reason to stop, above 0
  double wall = 0;  // a wall time [s]
};

/// How far from equilibrium the deformable bodies are.
struct ForceBalance {
  double net = 0, largest_net = 0;  // sum over them of |net force|, and the largest [N]
  double pressing = 0;              // sum over them of the sizes of contact forces at their nodes [N]
  std::int64_t bodies = 0;
  double mean() const { return pressing > 0 ? net / pressing : 0; }
  double largest() const { return pressing > 0 ? largest_net * static_cast<double>(bodies) / pressing : 0; }
};

/// sum over a piece's points of V sigma - m v (x) v, whose mean over the volume is the mean stress of a granular body:
/// in statics that of the contact forces (Love 1927, Weber 1966), and in a periodic domain the virial (xx yy zz xy yz
/// xz) [J].
template <int Dim>
std::array<double, 6> stress_of_points(const Piece<Dim>& piece, double density);

/// A crack's tip and what drives it.
template <int Dim>
struct TipState {
  CrackTip<Dim> tip;
  double J = 0, J_static = 0;           // with the terms of motion, and without [J/m2]
  double K_opening = 0, K_sliding = 0;  // [Pa m^1/2]; NaN where the law is not linear
  double length = 0;                    // by which it grew [m]
  double K_tearing = 0;                 // in 3D
};

}  // namespace cairn
