#include "cairn/body/shape.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

bool Compound::holds(const Vec3& x) const {
  const auto holds_it = [&](const Shape& part) { return contains(part, x); };
  if (of.empty()) return false;
  switch (operation) {
    case CompoundOperation::union_of:
      return std::any_of(of.begin(), of.end(), holds_it);
    case CompoundOperation::intersection:
      return std::all_of(of.begin(), of.end(), holds_it);
    case CompoundOperation::difference:
      return holds_it(of.front()) && std::none_of(of.begin() + 1, of.end(), holds_it);
  }
  return false;
}

Bounds Compound::extent() const {
  if (of.empty()) return shapes::nothing();
  Bounds all = bounds(of.front());
  if (operation == CompoundOperation::difference) {
    for (std::size_t i = 1; i < of.size(); ++i) {
      if (const auto* half = std::get_if<HalfSpace>(&of[i])) HalfSpace::cut(all, half->point, -half->normal);
    }
    return all;
  }
  const bool meet = operation == CompoundOperation::intersection;
  for (std::size_t i = 1; i < of.size(); ++i) {
    const Bounds b = bounds(of[i]);
    all.lower = meet ? all.lower.cwiseMax(b.lower).eval() : all.lower.cwiseMin(b.lower).eval();
    all.upper = meet ? all.upper.cwiseMin(b.upper).eval() : all.upper.cwiseMax(b.upper).eval();
  }
  // A second pass lets a plane make use of the bounds drawn in by one that comes after it.
  for (int pass = 0; meet && pass < 2; ++pass) {
    for (const Shape& part : of) {
      if (const auto* half = std::get_if<HalfSpace>(&part)) HalfSpace::cut(all, half->point, half->normal);
    }
  }
  return all;
}

double Compound::width() const {
  if (of.empty()) return shapes::infinity;
  if (operation == CompoundOperation::difference) return smallest_width(of.front());
  double least = shapes::infinity;
  for (const Shape& part : of) least = std::min(least, smallest_width(part));
  const Bounds b = extent();
  return std::min(least, shapes::least_positive(b.upper - b.lower));
}

void Compound::shift(const Vec3& way) {
  for (Shape& part : of) part = shifted(std::move(part), way);
}

bool contains(const Shape& shape, const Vec3& x) {
  return std::visit([&](const auto& s) { return s.holds(x); }, shape);
}

Bounds bounds(const Shape& shape) {
  return std::visit([](const auto& s) { return s.extent(); }, shape);
}

Vec3 centre(const Shape& shape) {
  const Bounds b = bounds(shape);
  return std::visit(
      [&](const auto& s) -> Vec3 {
        if constexpr (requires { s.centre; }) {
          return s.centre;
        } else if constexpr (requires { s.middle(); }) {
          return s.middle();
        } else {
          Vec3 middle = Vec3::Zero();  // directions without end count as zero: z of a half-space in 2D
          for (int k = 0; k < 3; ++k)
            if (std::isfinite(b.lower[k]) && std::isfinite(b.upper[k])) middle[k] = 0.5 * (b.lower[k] + b.upper[k]);
          return middle;
        }
      },
      shape);
}

double smallest_width(const Shape& shape) {
  return std::visit([](const auto& s) { return s.width(); }, shape);
}

Shape shifted(Shape shape, const Vec3& way) {
  std::visit([&](auto& s) { s.shift(way); }, shape);
  return shape;
}

double known_volume(const Shape& shape) {
  return std::visit(
      [](const auto& s) {
        if constexpr (requires { s.volume(); })
          return s.volume();
        else
          return -1.0;
      },
      shape);
}

}  // namespace cairn
