#include "cairn/body/shapes/polygon.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace cairn {
namespace shapes {
namespace {

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

}  // namespace

std::optional<std::pair<std::size_t, std::size_t>> crossing_edges(const std::vector<Edge>& edges) {
  const auto low = [&](std::size_t i) { return std::min(edges[i].from.x(), edges[i].to.x()); };
  std::vector<std::size_t> order(edges.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, low);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const double high = std::max(edges[order[k]].from.x(), edges[order[k]].to.x());
    for (std::size_t m = k + 1; m < order.size() && low(order[m]) <= high; ++m) {
      const auto [i, j] = std::minmax(order[k], order[m]);
      const bool next = edges[i].next == j, last = edges[j].next == i;
      const Edge &a = edges[last ? j : i], &b = edges[last ? i : j];  // edge b begins where a ends
      const bool back = turn(a.from, b.from, b.to) == 0 && (a.from - b.from).dot(b.to - b.from) > 0;
      if (next || last ? back : meet(edges[i].from, edges[i].to, edges[j].from, edges[j].to)) return std::pair(i, j);
    }
  }
  return std::nullopt;
}

std::vector<Vec3> without_repeated(const std::vector<Vec3>& points) {
  std::vector<Vec3> kept;
  for (const Vec3& p : points)
    if (kept.empty() || p != kept.back()) kept.push_back(p);
  while (kept.size() > 1 && kept.back() == kept.front()) kept.pop_back();
  return kept;
}

void add_edges(const std::vector<Vec3>& points, std::vector<Edge>& edges) {
  const std::size_t first = edges.size(), n = points.size();
  for (std::size_t i = 0; i < n; ++i) edges.push_back({points[i], points[(i + 1) % n], first + (i + 1) % n});
}

}  // namespace shapes

std::optional<shapes::Problem> Polygon::problem(int /*dimension*/) const {
  double area = 0, size = 0;
  for (std::size_t i = 0, n = points.size(); i < n; ++i) {
    const Vec3 a = points[i] - points[0], b = points[(i + 1) % n] - points[0];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
    size = std::max(size, a.squaredNorm());
  }
  if (points.size() < 3)
    return shapes::Problem{"points", fmt::format("has {} points; a polygon needs at least 3", points.size())};
  if (std::abs(area) <= 1e-12 * size)
    return shapes::Problem{"points", "enclose no area; the points must not lie on one line"};
  std::vector<shapes::Edge> edges;
  add_edges(shapes::without_repeated(points), edges);
  const auto crossing = crossing_edges(edges);
  if (!crossing) return std::nullopt;
  const Vec3 &a = edges[crossing->first].from, &b = edges[crossing->second].from;
  return shapes::Problem{
      "points", fmt::format("the edges that begin at [{}, {}] and [{}, {}] cross or touch each other; give the "
                            "corners in the order in which they follow each other around the body",
                            a.x(), a.y(), b.x(), b.y())};
}

/// Crossing number of the ray towards +x, without division; a point within the margin of an edge is inside.
bool Polygon::holds(const Vec3& x) const {
  bool in = false;
  const std::size_t n = points.size();
  for (std::size_t i = 0, j = n - 1; i < n; j = i++) {
    const double ex = points[i].x() - points[j].x(), ey = points[i].y() - points[j].y();
    const double dx = x.x() - points[j].x(), dy = x.y() - points[j].y();
    const double cross = ex * dy - ey * dx;  // above 0: left of the edge j -> i
    const double length2 = ex * ex + ey * ey, along = ex * dx + ey * dy;
    if (std::abs(cross) <= shapes::margin * length2 && along >= -shapes::margin * length2 &&
        along <= (1 + shapes::margin) * length2)
      return true;
    if ((dy >= 0) != (dy >= ey) && (cross > 0) == (ey > 0)) in = !in;
  }
  return in;
}

double Polygon::width() const {
  double least = shapes::infinity;
  for (std::size_t i = 0, n = points.size(); i < n; ++i) {
    const Vec3 edge = points[(i + 1) % n] - points[i];
    if (edge.norm() == 0) continue;
    const Vec3 across = Vec3(-edge.y(), edge.x(), 0).normalized();
    double low = shapes::infinity, high = -shapes::infinity;
    for (const Vec3& p : points) {
      low = std::min(low, across.dot(p));
      high = std::max(high, across.dot(p));
    }
    least = std::min(least, high - low);
  }
  return least;
}

}  // namespace cairn
