#pragma once
/// Points whose state no step can go on from.

#include <string>
#include <vector>

#include "cairn/body/patch.hpp"

namespace cairn {

/// What is wrong with a point. A cause comes before what it does to its neighbours within a stage of the step.
struct Fault {
  /// det F <= 0; a velocity or position, a deformation or stress that is not finite
  enum Kind { none, state, motion, inverted } kind = none;
  std::string text;  // body, point, position and what is wrong
};

/// What is wrong with a point of a deformable body.
template <int Dim>
Fault fault_of(const Points<Dim>& points, int p, int body);

/// The first deformable point of the worst kind, of one rank's patches.
template <int Dim>
Fault find_fault(const std::vector<Patch<Dim>>& patches, const std::vector<Body>& bodies);

}  // namespace cairn
