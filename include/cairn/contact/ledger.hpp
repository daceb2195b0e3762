#pragma once
/// The energy that contact gives to the points of a body at one node.
///
/// With FLIP the points gain f dt . (v + v')/2 from a force f at a node, exactly, where v = p/m is the momentum
/// projected at the start of the step and v' that projected again at its end; the strain energy takes f dt . (u + u')/2
/// with the velocities u, u' that strains see, which differ from v, v' by what contact changed on the nodes alone. So
/// contact gives  I . (v + v')/2 - f dt . (J + J')/(2 m)  with I its impulse on the points and J, J' its impulses
/// on the nodes before the strains. Where momentum is not projected again, v' = v and J' = J, to first order in dt.

#include "cairn/core/types.hpp"

namespace cairn::contact {

template <int Dim>
struct NodeRecord {
  Vec<Dim> projected = Vec<Dim>::Zero();  // momentum before contact
  Vec<Dim> force = Vec<Dim>::Zero();      // before contact
  Vec<Dim> first = Vec<Dim>::Zero();      // impulse on the nodes alone, J
  Vec<Dim> second = Vec<Dim>::Zero();     // impulse that reaches the points, I

  /// Energy given [J] when momentum was projected again as `again`, and contact changed it by `repeat`.
  double given(double mass, double dt, const Vec<Dim>& again, const Vec<Dim>& repeat) const {
    return 0.5 * (second.dot(projected + again) - dt * force.dot(first + repeat)) / mass;
  }
  /// Energy given [J] when it was not.
  double given(double mass, double dt) const { return given(mass, dt, projected, first); }
};

}  // namespace cairn::contact
