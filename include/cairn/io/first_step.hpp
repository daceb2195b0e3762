#pragma once
/// The first time step of a case, before anything has been placed.

#include "cairn/io/case.hpp"

namespace cairn {

struct FirstStep {
  double wave_speed = 0;   // the largest longitudinal one of the deformable bodies [m/s]; of all where there are none
  double point_speed = 0;  // the largest that a body's points can start with [m/s]
  double crossing = 0;     // time in which both together cross a cell [s]; infinite where nothing moves
  double dt = 0;           // [s]
};

FirstStep first_step(const Case& c);

/// The longest step [s] for which interfaces and cohesive laws of cracks are stable; infinite where there are none.
double longest_traction_step(const Case& c);

}  // namespace cairn
