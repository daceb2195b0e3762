#pragma once
/// Cracks as they are set up.

#include "cairn/crack/triangles.hpp"
#include "cairn/io/case.hpp"

namespace cairn {

/// The points of one of the case's cracks, as they begin, but for their bonds.
template <int Dim>
std::vector<CrackPoint<Dim>> initial_crack_points(const Case& c, std::size_t crack, double spacing);

/// The crack's line in segments of at most half a cell.
std::vector<Vec3> refined_crack(const CrackSpec& spec, double spacing);

/// Length [m] of a crack's line, around each of its points to the middle of the segments, that lies in bodies that it
/// cuts and in its cohesive range, where it has one.
std::vector<double> bound_lengths(const Case& c, const CrackSpec& spec, const std::vector<Vec3>& line);

/// Area [m2] around each point of a crack's surface, a third of its triangles', that lies in bodies that it cuts.
std::vector<double> bound_areas(const Case& c, const CrackSpec& spec, const Triangles& surface);

}  // namespace cairn
