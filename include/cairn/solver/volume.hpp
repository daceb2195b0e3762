#pragma once
/// How much of a shape lies in the domain.

#include "cairn/io/case.hpp"

namespace cairn {

/// Area (2D) or volume (3D) of a shape inside the domain [m^Dim]. Periodic directions do not cut what is finite there;
/// where it meets its own images, a place counts once. Exact for balls and for boxes along the axes, else from samples.
/// \param samples  along each direction
double volume_of(const Shape& shape, const Domain& domain, int samples);

/// Samples along each direction that so many bodies can have within a second or so.
int samples_for(std::size_t bodies, int dimension);

}  // namespace cairn
