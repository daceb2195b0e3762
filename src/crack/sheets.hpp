#pragma once
/// Triangles of cracks around a patch, from what crack points hold of them.

#include "cairn/crack/sides.hpp"

namespace cairn {

/// Lists the triangles of which the patch knows all corners, ascending in their cracks. An open rim is prolonged by
/// `beyond` [m] in the surface, for crossings alone. `normals`: of the patch's crack points.
void list_triangles(const Patch<3>& patch, double beyond, const std::vector<Crack>& cracks,
                    std::vector<CrackSegments<3>::Segment>& triangles,
                    std::vector<CrackSegments<3>::PointNormal>& normals);

}  // namespace cairn
