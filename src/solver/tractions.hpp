#pragma once
/// Cracks as they are set up.

#include "cairn/io/case.hpp"

namespace cairn {

/// The crack's line in segments of at most half a cell.
std::vector<Vec3> refined_crack(const CrackSpec& spec, double spacing);

/// Length [m] of a crack's line, around each of its points to the middle of the segments, that lies in bodies that it
/// cuts and in its cohesive range, where it has one.
std::vector<double> bound_lengths(const Case& c, const CrackSpec& spec, const std::vector<Vec3>& line);

}  // namespace cairn
