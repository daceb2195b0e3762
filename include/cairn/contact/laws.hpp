#pragma once
/// Laws of contact at a node, as pure functions. A body meets a partner: the rest of the node's bodies, a rigid body or
/// a wall. Everything is said by the body's excess momentum and force over the partner's motion (Nairn 2013, eqs. 5 and
/// 9 with the opposite sign):
///   P = p_a - (m_a/M) sum p,  F = f_a - (m_a/M) sum f
///   P = p_a - m_a v,          F = f_a                    against a rigid partner of velocity v
/// with n the unit normal out of the body. P . n > 0 means approach. Each function returns the impulse on the body.

#include <cmath>

#include "cairn/core/options.hpp"
#include "cairn/core/types.hpp"

namespace cairn::contact {

/// Whether a pair is held together in the normal direction, and in the tangential one, for this step.
struct Decision {
  bool hold = false, stick = false;
};

/// mu N for N > 0, else 0; mu may be infinite.
inline double friction_limit(double mu, double normal) { return normal > 0 ? mu * normal : 0.0; }

template <int Dim>
Vec<Dim> tangential(const Vec<Dim>& a, const Vec<Dim>& n) {
  return a - a.dot(n) * n;
}

/// Normal impulse -P_n n and a tangential one against the sliding, of at most `limit`.
template <int Dim>
Vec<Dim> limited_impulse(const Vec<Dim>& P, const Vec<Dim>& n, double normal, double limit) {
  const Vec<Dim> slip = tangential<Dim>(P, n);
  const double size = slip.norm();
  Vec<Dim> impulse = -normal * n;
  if (size > 0) impulse -= std::min(limit, size) / size * slip;
  return impulse;
}

/// Predicted reaction (the default release): the pair is held where the forces would press it together by the end of
/// the step, and sticks where friction can carry the tangential force.
template <int Dim>
Decision decide_by_reaction(const Vec<Dim>& P, const Vec<Dim>& F, const Vec<Dim>& n, double mu, double dt) {
  Decision d;
  d.hold = (P + dt * F).dot(n) > 0;
  d.stick = d.hold && tangential<Dim>(P + dt * F, n).norm() <= friction_limit(mu, dt * F.dot(n));
  return d;
}

/// Predicted reaction, before the momentum update (and when momentum is projected again): not given to the points.
template <int Dim>
Vec<Dim> hold_impulse(const Vec<Dim>& P, const Vec<Dim>& n, const Decision& decision) {
  if (!decision.hold) return Vec<Dim>::Zero();
  if (decision.stick) return -P;
  return -P.dot(n) * n;
}

/// Predicted reaction, after the momentum update: the reaction itself, with Coulomb friction on it.
template <int Dim>
Vec<Dim> reaction_impulse(const Vec<Dim>& P, const Vec<Dim>& n, const Decision& decision, double mu) {
  if (!decision.hold) return Vec<Dim>::Zero();
  const double normal = std::max(0.0, P.dot(n));
  return limited_impulse<Dim>(P, n, normal, friction_limit(mu, normal));
}

/// Release by approach: Bardenhagen, Brackbill & Sulsky 2000, eqs. 12-23.
template <int Dim>
Vec<Dim> approach_impulse(const Vec<Dim>& P, const Vec<Dim>& n, double mu) {
  const double normal = P.dot(n);
  if (normal <= 0) return Vec<Dim>::Zero();
  return limited_impulse<Dim>(P, n, normal, friction_limit(mu, normal));
}

/// Release by traction: Bardenhagen et al. 2001, section 2.1 and eq. 10. `compressive`: the normal traction is; where
/// the bodies are free of stress, approach decides.
template <int Dim>
Vec<Dim> traction_impulse(const Vec<Dim>& P, const Vec<Dim>& n, double mu, bool compressive, bool stress_free,
                          DepartingFriction departing) {
  const double normal = P.dot(n);
  if (!(compressive || (stress_free && normal > 0))) return Vec<Dim>::Zero();
  double limit = friction_limit(mu, normal);
  if (normal <= 0 && departing == DepartingFriction::coulomb) limit = friction_limit(mu, -normal);
  if (normal <= 0 && departing == DepartingFriction::printed) limit = tangential<Dim>(P, n).norm();
  return limited_impulse<Dim>(P, n, normal, limit);
}

/// Factor on an impulse that keeps it from collapsing a cell: Bardenhagen et al. 2001, eqs. 17-22, with min for the
/// printed max of eq. 22. `mass` the body's, `rest` the partner's (infinite for a rigid one).
template <int Dim>
double impulse_scale(const Vec<Dim>& impulse, double mass, double rest, const Vec<Dim>& spacing, double gamma,
                     double dt) {
  if (gamma <= 0) return 1;
  const double rate = (impulse.cwiseQuotient(spacing)).cwiseAbs().maxCoeff() / mass * std::max(mass / rest, 1.0);
  return rate * dt > gamma ? gamma / (rate * dt) : 1.0;
}

}  // namespace cairn::contact
