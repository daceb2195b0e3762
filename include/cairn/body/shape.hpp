#pragma once
/// Geometry of bodies: which points of space a body fills at the start. One set of shapes serves 2D and 3D:
/// in 2D every z is zero and a `Ball` is a disk. Each shape is a struct in a header of its own (CONTRIBUTING.md,
/// "Add a shape").

#include <variant>
#include <vector>

#include "cairn/body/shapes/ball.hpp"
#include "cairn/body/shapes/box.hpp"
#include "cairn/body/shapes/cylinder.hpp"
#include "cairn/body/shapes/ellipsoid.hpp"
#include "cairn/body/shapes/half_space.hpp"
#include "cairn/body/shapes/label_body.hpp"
#include "cairn/body/shapes/mesh.hpp"
#include "cairn/body/shapes/outline.hpp"
#include "cairn/body/shapes/polygon.hpp"

namespace cairn {

struct Compound;

/// New ones at the end: checkpoints know a shape by its place here.
using Shape = std::variant<Ball, BoxShape, Ellipsoid, Polygon, Cylinder, HalfSpace, Compound, Mesh, Outline, LabelBody>;

enum class CompoundOperation { union_of, difference, intersection };
/// Union, difference (the first without the others) or intersection of shapes.
struct Compound {
  CompoundOperation operation;
  std::vector<Shape> of;

  bool holds(const Vec3& x) const;
  Bounds extent() const;
  /// An estimate: what a difference takes away from its first shape does not count.
  double width() const;
  void shift(const Vec3& way);
};

/// True where `x` lies inside the shape (its boundary counts as inside).
bool contains(const Shape& shape, const Vec3& x);

/// Bounds that hold the shape; infinite for a half-space not cut by anything.
Bounds bounds(const Shape& shape);

/// Centre about which a body spins: the centre of a ball or ellipsoid, the centroid of a mesh or outline, the middle of
/// the largest ball in a label, else the middle of the finite bounds.
Vec3 centre(const Shape& shape);

/// Smallest width of the shape [m], an estimate for resolution warnings (twice the smallest radius for a ball).
double smallest_width(const Shape& shape);

/// The shape moved by a way [m].
Shape shifted(Shape shape, const Vec3& way);

/// Volume of a whole shape where it knows it itself [m^Dim]; below 0: it has to be measured.
double known_volume(const Shape& shape);

}  // namespace cairn
