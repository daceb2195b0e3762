// Where cracks begin: the points of lines and surfaces, and what they stand for.

#include <Eigen/Dense>

#include "tractions.hpp"

namespace cairn {
namespace {

constexpr double segment_length = 0.5;  // cells, at set-up

/// Whether a place lies in a body that the crack cuts.
bool in_cut_body(const Case& c, const CrackSpec& spec, const Vec3& x) {
  return std::ranges::any_of(c.bodies, [&](const BodySpec& body) {
    return spec.cuts(static_cast<int>(&body - c.bodies.data()), body.group) && contains(body.shape, x);
  });
}

}  // namespace

std::vector<Vec3> refined_crack(const CrackSpec& spec, double spacing) {
  std::vector<Vec3> points = {spec.points[0]};
  for (std::size_t i = 1; i < spec.points.size(); ++i) {
    const Vec3 from = spec.points[i - 1], step = spec.points[i] - from;
    const int parts = std::max(1, static_cast<int>(std::ceil(step.norm() / (segment_length * spacing) - 1e-9)));
    for (int k = 1; k < parts; ++k) points.push_back(from + step * (static_cast<double>(k) / parts));
    points.push_back(spec.points[i]);
  }
  return points;
}

std::vector<double> bound_areas(const Case& c, const CrackSpec& spec, const Triangles& surface) {
  constexpr int parts = 8;  // of each side of a triangle
  std::vector<double> areas(surface.points.size(), 0.0);
  for (const auto& corners : surface.corners) {
    const Vec3 &a = surface.points[corners[0]], b = surface.points[corners[1]], d = surface.points[corners[2]];
    const double area = 0.5 * (b - a).cross(d - a).norm() / (parts * parts);
    for (int i = 0; i < parts; ++i)
      for (int j = 0; j + i < parts; ++j)
        for (const double third : {1.0 / 3, 2.0 / 3}) {  // two small triangles, one the other way round
          const double u = (i + third) / parts, v = (j + third) / parts;
          if (u + v >= 1 || !in_cut_body(c, spec, a + u * (b - a) + v * (d - a))) continue;
          const std::array<double, 3> near = {1 - u - v, u, v};
          areas[corners[std::ranges::max_element(near) - near.begin()]] += area;
        }
  }
  return areas;
}

template <>
std::vector<CrackPoint<2>> initial_crack_points(const Case& c, std::size_t crack, double spacing) {
  constexpr int step = CrackPoint<2>::index_step;
  std::vector<CrackPoint<2>> points;
  const auto line = refined_crack(c.cracks[crack], spacing);
  const int last = (static_cast<int>(line.size()) - 1) * step;
  for (int i = 0; i < std::ssize(line); ++i) {
    CrackPoint<2> point;
    point.crack = static_cast<int>(crack), point.index = i * step, point.next = std::min(point.index + step, last);
    point.plane = point.lower = point.upper = line[i].head<2>();
    points.push_back(point);
  }
  return points;
}

template <>
std::vector<CrackPoint<3>> initial_crack_points(const Case& c, std::size_t crack, double spacing) {
  const CrackSpec& spec = c.cracks[crack];
  const Triangles surface = crack_surface(spec, spacing);
  const auto held = hold_surface(surface, spacing, [&](const Vec3& x) { return in_cut_body(c, spec, x); });
  std::vector<CrackPoint<3>> points;
  for (int i = 0; i < std::ssize(surface.points); ++i) {
    CrackPoint<3> point;
    static_cast<CrackHeld<3>&>(point) = held[i];
    point.crack = static_cast<int>(crack), point.index = point.next = i;
    point.plane = point.lower = point.upper = surface.points[i];
    points.push_back(point);
  }
  return points;
}

}  // namespace cairn
