#pragma once
/// Geometry of bodies: which points of space a body fills at the start. One set of shapes serves 2D and 3D:
/// in 2D every z is zero and a `Ball` is a disk.

#include <string>
#include <variant>
#include <vector>

#include "cairn/core/types.hpp"

namespace cairn {

/// Axis-aligned bounds [m]; may be infinite.
struct Bounds {
  Vec3 lower, upper;
};

struct Ball {
  Vec3 centre;
  double radius;  // [m]
};
/// Axis-aligned box turned by `angle` [rad] about its centre (about z).
struct BoxShape {
  Vec3 lower, upper;
  double angle = 0;
};
/// Ellipse or ellipsoid with half-axes `radii` [m], turned by `angle` [rad] about z.
struct Ellipsoid {
  Vec3 centre, radii;
  double angle = 0;
};
/// Simple polygon in the x-y plane, either orientation (2D only).
struct Polygon {
  std::vector<Vec3> points;
};
/// Solid cylinder between the centres of its ends (3D only).
struct Cylinder {
  Vec3 from, to;
  double radius;
};
/// The side of the plane that `normal` points away from.
struct HalfSpace {
  Vec3 point, normal;
};
struct Compound;

using Shape = std::variant<Ball, BoxShape, Ellipsoid, Polygon, Cylinder, HalfSpace, Compound>;

enum class CompoundOperation { union_of, difference, intersection };
/// Union, difference (the first without the others) or intersection of shapes.
struct Compound {
  CompoundOperation operation;
  std::vector<Shape> of;
};

/// True where `x` lies inside the shape (its boundary counts as inside).
bool contains(const Shape& shape, const Vec3& x);

/// Bounds that hold the shape; infinite for a half-space not cut by anything.
Bounds bounds(const Shape& shape);

/// Centre about which a body spins: the centre of a ball or ellipsoid, else of the finite bounds.
Vec3 centre(const Shape& shape);

/// Smallest width of the shape [m], an estimate for resolution warnings (twice the smallest radius for a ball).
double smallest_width(const Shape& shape);

}  // namespace cairn
