#pragma once
/// What set-up makes of the case.

#include "cairn/solver/simulation.hpp"

namespace cairn {

/// Conditions on the faces at the start.
template <int Dim>
FaceConditions<Dim> make_faces(const Case& c);

}  // namespace cairn
