#include "cairn/body/shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cairn {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Relative margin by which the boundary counts as inside, so that rounding does not drop points that lie on it.
constexpr double margin = 1e-12;

/// Coordinates of `x` in the frame of a shape centred at `c` and turned by `angle` about z.
Vec3 local(const Vec3& x, const Vec3& c, double angle) {
  const Vec3 d = x - c;
  if (angle == 0) return d;
  const double cs = std::cos(angle), sn = std::sin(angle);
  return {cs * d.x() + sn * d.y(), cs * d.y() - sn * d.x(), d.z()};
}

Bounds around(const Vec3& c, const Vec3& half) { return {c - half, c + half}; }

bool inside(const Ball& s, const Vec3& x) { return (x - s.centre).squaredNorm() <= s.radius * s.radius * (1 + margin); }

bool inside(const BoxShape& s, const Vec3& x) {
  const Vec3 half = 0.5 * (s.upper - s.lower);
  const Vec3 d = local(x, 0.5 * (s.lower + s.upper), s.angle).cwiseAbs();
  return (d.array() <= half.array() + margin * half.maxCoeff()).all();
}

bool inside(const Ellipsoid& s, const Vec3& x) {
  const Vec3 d = local(x, s.centre, s.angle);
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    if (s.radii[k] > 0) sum += d[k] * d[k] / (s.radii[k] * s.radii[k]);
  }
  return sum <= 1 + margin;
}

/// Crossing number of the ray towards +x, without division; a point within the margin of an edge is inside.
bool inside(const Polygon& s, const Vec3& x) {
  bool in = false;
  const std::size_t n = s.points.size();
  for (std::size_t i = 0, j = n - 1; i < n; j = i++) {
    const double ex = s.points[i].x() - s.points[j].x(), ey = s.points[i].y() - s.points[j].y();
    const double dx = x.x() - s.points[j].x(), dy = x.y() - s.points[j].y();
    const double cross = ex * dy - ey * dx;  // above 0: left of the edge j -> i
    const double length2 = ex * ex + ey * ey, along = ex * dx + ey * dy;
    if (std::abs(cross) <= margin * length2 && along >= -margin * length2 && along <= (1 + margin) * length2)
      return true;
    if ((dy >= 0) != (dy >= ey) && (cross > 0) == (ey > 0)) in = !in;
  }
  return in;
}

bool inside(const Cylinder& s, const Vec3& x) {
  const Vec3 axis = s.to - s.from, d = x - s.from;
  const double length2 = axis.squaredNorm(), along = d.dot(axis) / length2;
  return along >= -margin && along <= 1 + margin &&
         (d - along * axis).squaredNorm() <= s.radius * s.radius * (1 + margin);
}

bool inside(const HalfSpace& s, const Vec3& x) {
  const Vec3 d = x - s.point;
  return d.dot(s.normal) <= margin * d.norm() * s.normal.norm();
}

bool inside(const Compound& s, const Vec3& x) {
  const auto holds = [&](const Shape& part) { return contains(part, x); };
  if (s.of.empty()) return false;
  switch (s.operation) {
    case CompoundOperation::union_of:
      return std::any_of(s.of.begin(), s.of.end(), holds);
    case CompoundOperation::intersection:
      return std::all_of(s.of.begin(), s.of.end(), holds);
    case CompoundOperation::difference:
      return holds(s.of.front()) && std::none_of(s.of.begin() + 1, s.of.end(), holds);
  }
  return false;
}

Bounds extent(const Ball& s) { return around(s.centre, Vec3::Constant(s.radius)); }

Bounds extent(const BoxShape& s) {
  const Vec3 half = 0.5 * (s.upper - s.lower);
  if (s.angle == 0) return {s.lower, s.upper};
  const double cs = std::abs(std::cos(s.angle)), sn = std::abs(std::sin(s.angle));
  return around(0.5 * (s.lower + s.upper), {cs * half.x() + sn * half.y(), sn * half.x() + cs * half.y(), half.z()});
}

Bounds extent(const Ellipsoid& s) {
  const double cs = std::cos(s.angle), sn = std::sin(s.angle);
  const double a = s.radii.x(), b = s.radii.y();
  return around(s.centre, {std::hypot(cs * a, sn * b), std::hypot(sn * a, cs * b), s.radii.z()});
}

Bounds extent(const Polygon& s) {
  Bounds all{Vec3::Constant(infinity), Vec3::Constant(-infinity)};
  for (const Vec3& p : s.points) {
    all.lower = all.lower.cwiseMin(p);
    all.upper = all.upper.cwiseMax(p);
  }
  return all;
}

Bounds extent(const Cylinder& s) {
  const Vec3 axis = (s.to - s.from).normalized();
  const Vec3 half = s.radius * (1 - axis.array().square()).max(0).sqrt().matrix();
  return {s.from.cwiseMin(s.to) - half, s.from.cwiseMax(s.to) + half};
}

/// Draws the bounds in to those of their part on the side of the plane that `normal` points away from.
void cut(Bounds& box, const Vec3& point, const Vec3& normal) {
  for (int k = 0; k < 3; ++k) {
    if (normal[k] == 0) continue;
    double room = normal[k] * point[k];  // normal_k x_k is at most this, whatever the other coordinates are
    for (int j = 0; j < 3; ++j) {
      if (j == k || normal[j] == 0) continue;
      room += normal[j] * (point[j] - (normal[j] > 0 ? box.lower[j] : box.upper[j]));
    }
    if (!std::isfinite(room)) continue;
    if (normal[k] > 0) box.upper[k] = std::min(box.upper[k], room / normal[k]);
    if (normal[k] < 0) box.lower[k] = std::max(box.lower[k], room / normal[k]);
  }
}

Bounds extent(const HalfSpace& s) {
  Bounds all{Vec3::Constant(-infinity), Vec3::Constant(infinity)};
  cut(all, s.point, s.normal);
  return all;
}

Bounds extent(const Compound& s) {
  if (s.of.empty()) return {Vec3::Constant(infinity), Vec3::Constant(-infinity)};
  Bounds all = bounds(s.of.front());
  if (s.operation == CompoundOperation::difference) {
    for (std::size_t i = 1; i < s.of.size(); ++i) {
      if (const auto* half = std::get_if<HalfSpace>(&s.of[i])) cut(all, half->point, -half->normal);
    }
    return all;
  }
  const bool meet = s.operation == CompoundOperation::intersection;
  for (std::size_t i = 1; i < s.of.size(); ++i) {
    const Bounds b = bounds(s.of[i]);
    all.lower = meet ? all.lower.cwiseMax(b.lower).eval() : all.lower.cwiseMin(b.lower).eval();
    all.upper = meet ? all.upper.cwiseMin(b.upper).eval() : all.upper.cwiseMax(b.upper).eval();
  }
  // A second pass lets a plane make use of the bounds drawn in by one that comes after it.
  for (int pass = 0; meet && pass < 2; ++pass) {
    for (const Shape& part : s.of) {
      if (const auto* half = std::get_if<HalfSpace>(&part)) cut(all, half->point, half->normal);
    }
  }
  return all;
}

/// Smallest of the widths above zero: in 2D the z extent is zero.
double least_positive(const Vec3& widths) {
  double least = infinity;
  for (double w : widths) {
    if (w > 0) least = std::min(least, w);
  }
  return least;
}

double width(const Ball& s) { return 2 * s.radius; }
double width(const BoxShape& s) { return least_positive(s.upper - s.lower); }
double width(const Ellipsoid& s) { return 2 * least_positive(s.radii); }
double width(const Cylinder& s) { return std::min(2 * s.radius, (s.to - s.from).norm()); }
double width(const HalfSpace&) { return infinity; }

/// Least distance between two lines along an edge which hold the polygon between them.
double width(const Polygon& s) {
  double least = infinity;
  for (std::size_t i = 0, n = s.points.size(); i < n; ++i) {
    const Vec3 edge = s.points[(i + 1) % n] - s.points[i];
    if (edge.norm() == 0) continue;
    const Vec3 across = Vec3(-edge.y(), edge.x(), 0).normalized();
    double low = infinity, high = -infinity;
    for (const Vec3& p : s.points) {
      low = std::min(low, across.dot(p));
      high = std::max(high, across.dot(p));
    }
    least = std::min(least, high - low);
  }
  return least;
}

/// An estimate: what a difference takes away from its first shape does not count.
double width(const Compound& s) {
  if (s.of.empty()) return infinity;
  if (s.operation == CompoundOperation::difference) return smallest_width(s.of.front());
  double least = infinity;
  for (const Shape& part : s.of) least = std::min(least, smallest_width(part));
  const Bounds b = extent(s);
  return std::min(least, least_positive(b.upper - b.lower));
}

}  // namespace

bool contains(const Shape& shape, const Vec3& x) {
  return std::visit([&](const auto& s) { return inside(s, x); }, shape);
}

Bounds bounds(const Shape& shape) {
  return std::visit([](const auto& s) { return extent(s); }, shape);
}

Vec3 centre(const Shape& shape) {
  if (const auto* ball = std::get_if<Ball>(&shape)) return ball->centre;
  if (const auto* ellipsoid = std::get_if<Ellipsoid>(&shape)) return ellipsoid->centre;
  const Bounds b = bounds(shape);
  Vec3 middle = Vec3::Zero();  // directions without end count as zero: z of a half-space in 2D
  for (int k = 0; k < 3; ++k) {
    if (std::isfinite(b.lower[k]) && std::isfinite(b.upper[k])) middle[k] = 0.5 * (b.lower[k] + b.upper[k]);
  }
  return middle;
}

double smallest_width(const Shape& shape) {
  return std::visit([](const auto& s) { return width(s); }, shape);
}

}  // namespace cairn
