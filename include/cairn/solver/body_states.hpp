#pragma once
/// States of whole bodies: mass, centre, velocity, spin and mean stress, summed over their pieces in patch order.

#include "cairn/solver/simulation.hpp"

namespace cairn {

/// One body as a whole. Positions are continuous across periodic boundaries.
struct BodyState {
  int body = 0;
  int points = 0;                         // that it has now
  double mass = 0;                        // [kg]
  double volume = 0;                      // of its points [m3]
  Vec3 centre = Vec3::Zero();             // [m]
  Vec3 velocity = Vec3::Zero();           // [m/s]
  Vec3 angular_velocity = Vec3::Zero();   // of the rigid motion with the same angular momentum [rad/s]
  Vec3 angular_momentum = Vec3::Zero();   // about the centre [kg m2/s]
  std::array<double, 6> mean_stress{};    // xx yy zz xy yz xz [Pa]
  std::array<double, 6> second_moment{};  // mean of r r^T over the mass, r from the centre: xx yy zz xy yz xz [m2]
  int contacts = 0;                       // bodies touched since the contacts were last cleared
};

/// States of this rank's share of the bodies, which is [count * rank / ranks, count * (rank + 1) / ranks). Collective.
template <int Dim>
std::vector<BodyState> body_states(const Simulation<Dim>& simulation);

/// One pair of touching bodies.
struct ContactState {
  int body_a = 0, body_b = 0;  // a < b
  Vec3 point = Vec3::Zero();   // weighted by the impulses [m]
  Vec3 normal = Vec3::Zero();  // unit, from a to b
  Vec3 force = Vec3::Zero();   // on a, averaged over the time since the contacts were last cleared [N]
};

/// Contacts of this rank's share of the bodies (by body_a), ascending in (a, b), averaged over `duration` [s].
/// Collective.
template <int Dim>
std::vector<ContactState> contact_states(const Simulation<Dim>& simulation, double duration);

}  // namespace cairn
