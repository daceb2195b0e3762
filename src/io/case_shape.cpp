// The shapes of bodies.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "case_names.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

Shape read_ball(Table& t, int dim) {
  return Ball{t.vector("centre", dim, std::nullopt), t.number("radius", std::nullopt, positive)};
}

Shape read_box(Table& t, int dim) {
  const std::size_t before = t.error_count();
  BoxShape box{t.vector("lower", dim, std::nullopt), t.vector("upper", dim, std::nullopt), t.number("angle", 0.0)};
  for (int k = 0; k < dim && t.error_count() == before; ++k)
    if (!(box.upper[k] > box.lower[k])) {
      t.error("upper", fmt::format("{} is not above lower ({}) in direction {}; it must be greater", box.upper[k],
                                   box.lower[k], "xyz"[k]));
    }
  return box;
}

Shape read_ellipsoid(Table& t, int dim) {
  return Ellipsoid{t.vector("centre", dim, std::nullopt), t.vector("radii", dim, std::nullopt, positive),
                   t.number("angle", 0.0)};
}

/// Twice the area of the triangle a b c, positive anticlockwise.
double turn(const Vec3& a, const Vec3& b, const Vec3& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// The point c, which lies on the line through a and b, lies between them.
bool between(const Vec3& a, const Vec3& b, const Vec3& c) { return (a - c).cwiseProduct(b - c).maxCoeff() <= 0; }

/// The edges a b and c d have a point in common.
bool meet(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const double abc = turn(a, b, c), abd = turn(a, b, d), cda = turn(c, d, a), cdb = turn(c, d, b);
  if (abc * abd < 0 && cda * cdb < 0) return true;
  return (abc == 0 && between(a, b, c)) || (abd == 0 && between(a, b, d)) || (cda == 0 && between(c, d, a)) ||
         (cdb == 0 && between(c, d, b));
}

/// Two edges that meet elsewhere than at the point they follow each other at, by the points they begin at; nothing
/// where there are none. Edges are compared with those that overlap them in x.
std::optional<std::pair<std::size_t, std::size_t>> crossing_edges(const std::vector<Vec3>& p) {
  const std::size_t n = p.size();
  const auto end = [&](std::size_t i) -> const Vec3& { return p[(i + 1) % n]; };
  const auto low = [&](std::size_t i) { return std::min(p[i].x(), end(i).x()); };
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, low);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t m = k + 1; m < n && low(order[m]) <= std::max(p[order[k]].x(), end(order[k]).x()); ++m) {
      const auto [i, j] = std::minmax(order[k], order[m]);
      const bool next = j == i + 1, last = i == 0 && j == n - 1;
      const std::size_t a = last ? j : i, b = last ? i : j;  // edge b begins where a ends
      const bool back = turn(p[a], p[b], end(b)) == 0 && (p[a] - p[b]).dot(end(b) - p[b]) > 0;
      if (next || last ? back : meet(p[i], end(i), p[j], end(j))) return std::pair(i, j);
    }
  return std::nullopt;
}

/// The points without those that repeat the one before, the first at the end among them.
std::vector<Vec3> without_repeated(const std::vector<Vec3>& points) {
  std::vector<Vec3> kept;
  for (const Vec3& p : points)
    if (kept.empty() || p != kept.back()) kept.push_back(p);
  while (kept.size() > 1 && kept.back() == kept.front()) kept.pop_back();
  return kept;
}

Shape read_polygon(Table& t, int dim) {
  const std::size_t before = t.error_count();
  Polygon polygon{t.vectors("points", dim)};
  if (t.error_count() != before) return polygon;
  double area = 0, size = 0;
  for (std::size_t i = 0, n = polygon.points.size(); i < n; ++i) {
    const Vec3 a = polygon.points[i] - polygon.points[0], b = polygon.points[(i + 1) % n] - polygon.points[0];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
    size = std::max(size, a.squaredNorm());
  }
  if (polygon.points.size() < 3) {
    t.error("points", fmt::format("has {} points; a polygon needs at least 3", polygon.points.size()));
  } else if (std::abs(area) <= 1e-12 * size) {
    t.error("points", "enclose no area; the points must not lie on one line");
  } else if (const auto corners = without_repeated(polygon.points); const auto edges = crossing_edges(corners)) {
    const Vec3 &a = corners[edges->first], &b = corners[edges->second];
    t.error("points", fmt::format("the edges that begin at [{}, {}] and [{}, {}] cross or touch each other; give the "
                                  "corners in the order in which they follow each other around the body",
                                  a.x(), a.y(), b.x(), b.y()));
  }
  return polygon;
}

Shape read_cylinder(Table& t, int dim) {
  const std::size_t before = t.error_count();
  Cylinder cylinder{t.vector("from", dim, std::nullopt), t.vector("to", dim, std::nullopt),
                    t.number("radius", std::nullopt, positive)};
  if (t.error_count() == before && cylinder.from == cylinder.to)
    t.error("to", "equals from; the cylinder must have a length");
  return cylinder;
}

Shape read_half_space(Table& t, int dim) {
  const std::size_t before = t.error_count();
  HalfSpace half{t.vector("point", dim, std::nullopt), t.vector("normal", dim, std::nullopt)};
  if (t.error_count() == before && half.normal.norm() == 0) t.error("normal", "is zero; it must have a length");
  return half;
}

struct ShapeKind {
  std::string_view name;
  int dimension;  // 0: both
  Shape (*read)(Table&, int);
};
constexpr ShapeKind shape_kinds[] = {
    {"disk", 2, read_ball},         {"sphere", 3, read_ball},          {"box", 0, read_box},
    {"ellipse", 2, read_ellipsoid}, {"ellipsoid", 3, read_ellipsoid},  {"polygon", 2, read_polygon},
    {"cylinder", 3, read_cylinder}, {"half_space", 0, read_half_space}};

Shape read_compound(Table& t, CompoundOperation operation, int dim, Errors& errors) {
  Compound compound{operation, {}};
  const std::size_t least = operation == CompoundOperation::union_of ? 1 : 2;
  auto parts = t.tables("of");
  if (!t.has("of")) t.missing("of", "is missing; it must be an array of shapes");
  if (t.has("of") && parts.size() < least)
    t.error("of", fmt::format("holds {} shapes; this operation needs at least {}", parts.size(), least));
  for (Table& part : parts)
    if (auto shape = read_shape(part, dim, errors)) compound.of.push_back(std::move(*shape));
  return compound;
}

}  // namespace

std::optional<Shape> read_shape(Table table, int dimension, Errors& errors) {
  const std::size_t before = errors.count();
  std::vector<std::string_view> names;
  for (const auto& kind : shape_kinds)
    if (kind.dimension == 0 || kind.dimension == dimension) names.push_back(kind.name);
  const std::size_t simple = names.size();
  for (const auto& compound : compound_names) names.push_back(compound.name);

  if (!table.has("type")) table.missing("type", "is missing; choose one of " + listed(names));
  const std::size_t choice = table.choose("type", names);
  if (choice >= names.size()) return std::nullopt;
  std::optional<Shape> shape;
  if (choice >= simple) {
    shape = read_compound(table, compound_names[choice - simple].value, dimension, errors);
  } else {
    shape = std::ranges::find(shape_kinds, names[choice], &ShapeKind::name)->read(table, dimension);
  }
  table.finish();
  if (errors.count() != before) shape.reset();
  return shape;
}

}  // namespace cairn::reading
