#pragma once
/// How a rigid body that turns or gathers speed moves at a node, as contact sees it.
///
/// In a step its points go round along chords. What sticks to it must as well: along the tangent it would spiral
/// outwards, by t^2/2 of the radius in a step of angle t. With u = w x arm, chords of the step before and of this step
/// are (sin t u -+ (1 - cos t) w/|w| x u) / t: the velocities that points have with the leapfrog of FLIP, and their
/// difference is the centripetal acceleration.

#include "cairn/body/piece.hpp"

namespace cairn::contact {

template <int Dim>
struct Course {
  Vec<Dim> velocity;  // at the start of the step [m/s]
  Vec<Dim> change;    // in the step [m/s]
};

/// Course of the turning body at a node where its points have the velocity `now` = v + w x arm [m/s].
template <int Dim>
Course<Dim> course_of(const Body& body, const Vec<Dim>& now, double dt) {
  const double speed = body.angular_velocity.norm(), angle = speed * dt;
  if (speed == 0) return {now, body.change.head<Dim>()};
  Vec3 u = -body.velocity;
  u.head<Dim>() += now;
  const Vec3 inwards = (1 - std::cos(angle)) / angle * body.angular_velocity.cross(u) / speed;
  const Vec3 start = body.velocity + std::sin(angle) / angle * u - inwards;
  return {start.head<Dim>(), (2 * inwards + body.change).template head<Dim>()};
}

}  // namespace cairn::contact
