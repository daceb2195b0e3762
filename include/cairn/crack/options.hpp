#pragma once
/// Cracks as the case file gives them (docs/cracks.md).

#include <array>
#include <string>
#include <vector>

#include "cairn/core/types.hpp"

namespace cairn {

/// What passes between a crack's faces.
enum class CrackLaw { stick, friction, frictionless, free };
/// An end inside the body, or at or beyond its surface.
enum class CrackEnd { open, tip };

struct CrackSpec {
  std::vector<Vec3> points;  // [m], in the crack's direction
  std::array<CrackEnd, 2> ends = {CrackEnd::open, CrackEnd::open};
  CrackLaw law = CrackLaw::friction;
  double friction = 0.3;
  std::vector<std::string> groups;  // of the bodies that it cuts; empty: all that are not rigid
  std::string source;               // where it was defined, for messages
};

struct CrackOptions {
  std::array<double, 2> j_radius = {1, 4};  // [cells]: where the weight of the J-integral begins to fall, and ends
};

}  // namespace cairn
