#include "cairn/crack/triangles.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <map>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

constexpr double edge_length = 0.5;   // spacings, of surfaces that are laid out
constexpr double longest_edge = 0.6;  // of those from files: longer ones are halved
constexpr double further_out = 0.51;  // spacings from the rim at which a body ends it

using Corners = std::array<std::int32_t, 3>;
using Edge = std::pair<std::int32_t, std::int32_t>;

Edge sorted(std::int32_t a, std::int32_t b) { return std::minmax(a, b); }

int parts_of(double length, double spacing) {
  return std::max(1, static_cast<int>(std::ceil(length / (edge_length * spacing) - 1e-9)));
}

/// Rings of points around the middle, the k-th of 6 k.
Triangles lay_out(const CrackDisk& disk, double spacing) {
  const Vec3 n = disk.normal.normalized();
  int least = 0;
  n.cwiseAbs().minCoeff(&least);
  const Vec3 u = (Vec3::Unit(least) - n[least] * n).normalized(), v = n.cross(u);
  const int rings = parts_of(disk.radius, spacing);
  Triangles t;
  t.points.push_back(disk.centre);
  const auto number = [](int ring, int i) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1) + i % (6 * ring); };
  for (int k = 1; k <= rings; ++k) {
    for (int i = 0; i < 6 * k; ++i) {
      const double angle = M_PI * i / (3 * k), r = disk.radius * k / rings;
      t.points.push_back(disk.centre + r * (std::cos(angle) * u + std::sin(angle) * v));
    }
    for (int sector = 0; sector < 6; ++sector)
      for (int j = 0; j < k; ++j) {
        const int inner = sector * (k - 1) + j, outer = sector * k + j;
        t.corners.push_back({number(k - 1, inner), number(k, outer), number(k, outer + 1)});
        if (j + 1 < k) t.corners.push_back({number(k - 1, inner), number(k, outer + 1), number(k - 1, inner + 1)});
      }
  }
  return t;
}

/// A polyline drawn out.
Triangles lay_out(const std::vector<Vec3>& line, const Vec3& extrude, double spacing) {
  std::vector<Vec3> columns = {line[0]};
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vec3 step = line[i] - line[i - 1];
    const int parts = parts_of(step.norm(), spacing);
    for (int k = 1; k <= parts; ++k) columns.push_back(line[i - 1] + step * (static_cast<double>(k) / parts));
  }
  const int rows = parts_of(extrude.norm(), spacing), stride = rows + 1;
  Triangles t;
  for (const Vec3& x : columns)
    for (int j = 0; j <= rows; ++j) t.points.push_back(x + extrude * (static_cast<double>(j) / rows));
  for (int i = 0; i + 1 < std::ssize(columns); ++i)
    for (int j = 0; j < rows; ++j) {
      const int a = i * stride + j, b = a + 1, c = a + stride + 1, d = a + stride;
      if ((i + j) % 2 == 0)
        t.corners.push_back({a, b, c}), t.corners.push_back({a, c, d});
      else
        t.corners.push_back({a, b, d}), t.corners.push_back({b, c, d});
    }
  return t;
}

/// A triangle whose edges have the middles m (-1: none), in parts; m[k] lies between corners k and k + 1.
void divide(const Corners& c, const std::array<std::int32_t, 3>& m, std::vector<Corners>& parts) {
  const auto count = std::ranges::count_if(m, [](auto i) { return i >= 0; });
  if (count == 0) parts.push_back(c);
  if (count == 3)
    for (const Corners& part : {Corners{c[0], m[0], m[2]}, Corners{c[1], m[1], m[0]}, Corners{c[2], m[2], m[1]}, m})
      parts.push_back(part);
  for (int k = 0; k < 3 && (count == 1 || count == 2); ++k) {
    const int next = (k + 1) % 3, last = (k + 2) % 3;
    const bool first = m[k] >= 0 && (count == 1 || m[next] >= 0);
    if (!first) continue;
    if (count == 1)
      parts.push_back({c[k], m[k], c[last]}), parts.push_back({m[k], c[next], c[last]});
    else
      for (const Corners& part :
           {Corners{m[k], c[next], m[next]}, Corners{c[k], m[k], m[next]}, Corners{c[k], m[next], c[last]}})
        parts.push_back(part);
  }
}

/// Halves edges until none is longer than that.
void refine(Triangles& t, double longest) {
  for (bool again = true; again;) {
    std::map<Edge, std::int32_t> middles;
    std::vector<Corners> parts;
    for (const Corners& c : t.corners) {
      std::array<std::int32_t, 3> m = {-1, -1, -1};
      for (int k = 0; k < 3; ++k) {
        const auto a = c[k], b = c[(k + 1) % 3];
        if ((t.points[a] - t.points[b]).norm() <= longest) continue;
        const auto [at, fresh] = middles.try_emplace(sorted(a, b), static_cast<std::int32_t>(t.points.size()));
        if (fresh) t.points.push_back(0.5 * (t.points[a] + t.points[b]));
        m[k] = at->second;
      }
      divide(c, m, parts);
    }
    t.corners = std::move(parts), again = !middles.empty();
  }
}

/// How many triangles have each edge.
std::map<Edge, int> count_edges(const Triangles& t) {
  std::map<Edge, int> count;
  for (const Corners& c : t.corners)
    for (int k = 0; k < 3; ++k) ++count[sorted(c[k], c[(k + 1) % 3])];
  return count;
}

}  // namespace

Triangles crack_surface(const CrackSpec& spec, double spacing) {
  if (spec.disk) return lay_out(*spec.disk, spacing);
  if (!spec.file) return lay_out(spec.points, spec.extrude, spacing);
  Triangles t = spec.file->triangles;
  refine(t, longest_edge * spacing);
  return t;
}

std::string problem_of_surface(const Triangles& t) {
  if (t.corners.empty()) return "holds no triangle with an area";
  for (const auto& [edge, count] : count_edges(t))
    if (count > 2) {
      const Vec3 x = 0.5 * (t.points[edge.first] + t.points[edge.second]);
      return fmt::format(
          "has an edge that {} triangles share, at {:.6g}, {:.6g}, {:.6g} m; give a crack that branches "
          "as several",
          count, x.x(), x.y(), x.z());
    }
  return {};
}

std::vector<CrackHeld<3>> hold_surface(const Triangles& t, double spacing,
                                       const std::function<bool(const Vec3&)>& inside) {
  const auto count = count_edges(t);
  std::vector<CrackHeld<3>> held(t.points.size());
  for (const Corners& c : t.corners) {
    int first = 0;
    for (int k = 1; k < 3; ++k)
      if (held[c[k]].held < held[c[first]].held) first = k;
    CrackHeld<3>& holder = held[c[first]];
    if (holder.held == CrackHeld<3>::most)
      throw InputError(
          fmt::format("more than {} triangles of a crack's surface would fall to the point at {:.6g}, "
                      "{:.6g}, {:.6g} m; give a more regular surface",
                      CrackHeld<3>::most, t.points[c[first]].x(), t.points[c[first]].y(), t.points[c[first]].z()));
    CrackTriangle& triangle = holder.triangles[holder.held++];
    triangle.second = c[(first + 1) % 3], triangle.third = c[(first + 2) % 3];
    const Vec3 normal = (t.points[c[1]] - t.points[c[0]]).cross(t.points[c[2]] - t.points[c[0]]).normalized();
    for (int k = 0; k < 3; ++k) {
      const auto a = c[(first + k) % 3], b = c[(first + k + 1) % 3];
      if (count.at(sorted(a, b)) > 1) continue;
      const Vec3 out = (t.points[b] - t.points[a]).normalized().cross(normal);
      const bool tip = inside(0.5 * (t.points[a] + t.points[b]) + further_out * spacing * out);
      triangle.set_edge(k, tip ? CrackEdge::tip : CrackEdge::open);
      if (tip) held[a].tip = held[b].tip = true;
    }
  }
  return held;
}

}  // namespace cairn
