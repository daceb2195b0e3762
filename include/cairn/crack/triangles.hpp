#pragma once
/// Surfaces of cracks in 3D, as they are set up: triangles over crack points, and what their rim is.

#include <functional>

#include "cairn/body/crack_point.hpp"
#include "cairn/crack/options.hpp"

namespace cairn {

/// The crack's surface in triangles with edges of about half a spacing [m]. Numbers of points depend on the crack and
/// the spacing alone.
Triangles crack_surface(const CrackSpec& spec, double spacing);

/// What keeps a surface from being a crack's; empty where nothing does.
std::string problem_of_surface(const Triangles& surface);

/// What each point of a surface holds of it. An edge of the rim is a tip where the place half a spacing further out
/// lies inside, by \param inside of the bodies that the crack cuts; else open.
/// \throws InputError where triangles meet so that points would have to hold too many
std::vector<CrackHeld<3>> hold_surface(const Triangles& surface, double spacing,
                                       const std::function<bool(const Vec3&)>& inside);

}  // namespace cairn
