// Mending surfaces, and what is wrong with them.

#include <algorithm>
#include <bit>
#include <numeric>
#include <unordered_map>

#include "cairn/body/solid.hpp"
#include "triangle_tree.hpp"

namespace cairn {
namespace {

using Corners = std::array<std::int32_t, 3>;

struct PointHash {
  std::size_t operator()(const std::array<double, 3>& p) const {
    std::uint64_t h = 0;
    for (const double v : p) h = (h ^ std::bit_cast<std::uint64_t>(v)) * 0x9E3779B97F4A7C15ULL, h ^= h >> 29;
    return h;
  }
};

void merge_points(Triangles& t) {
  std::unordered_map<std::array<double, 3>, std::int32_t, PointHash> known;
  known.reserve(t.points.size());
  std::vector<std::int32_t> to(t.points.size());
  std::vector<Vec3> kept;
  for (std::size_t i = 0; i < t.points.size(); ++i) {
    const Vec3 p = t.points[i].array() + 0.0;  // -0 becomes 0
    const auto [entry, fresh] = known.try_emplace({p.x(), p.y(), p.z()}, static_cast<std::int32_t>(kept.size()));
    if (fresh) kept.push_back(p);
    to[i] = entry->second;
  }
  t.points = std::move(kept);
  for (Corners& c : t.corners)
    for (auto& corner : c) corner = to[corner];
}

Vec3 middle_of(const Triangles& t, const Corners& c) { return (t.points[c[0]] + t.points[c[1]] + t.points[c[2]]) / 3; }

/// Leaves out what has no area or is there already.
void drop_useless(Triangles& t, SurfaceFaults& faults) {
  std::vector<std::pair<Corners, std::int32_t>> sorted;
  for (std::int32_t i = 0; i < std::ssize(t.corners); ++i) {
    Corners c = t.corners[i];
    std::ranges::sort(c);
    if (c[0] == c[1] || c[1] == c[2])
      ++faults.flat;
    else
      sorted.emplace_back(c, i);
  }
  std::ranges::sort(sorted);
  std::vector<std::int32_t> kept;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (i > 0 && sorted[i].first == sorted[i - 1].first) {
      if (faults.repeated++ == 0) faults.repeated_at = middle_of(t, sorted[i].first);
    } else {
      kept.push_back(sorted[i].second);
    }
  }
  std::ranges::sort(kept);
  std::vector<Corners> corners;
  corners.reserve(kept.size());
  for (const auto i : kept) corners.push_back(t.corners[i]);
  t.corners = std::move(corners);
}

/// A side of a triangle: its ends, the lower number first.
struct Side {
  std::int32_t low, high, triangle;
  bool forward;  // the triangle runs from low to high
  bool same_ends(const Side& o) const { return low == o.low && high == o.high; }
};

std::vector<Side> sides_of(const Triangles& t) {
  std::vector<Side> sides;
  sides.reserve(3 * t.corners.size());
  for (std::int32_t i = 0; i < std::ssize(t.corners); ++i)
    for (int k = 0; k < 3; ++k) {
      const auto a = t.corners[i][k], b = t.corners[i][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), i, a < b});
    }
  std::ranges::sort(sides, {}, [](const Side& s) { return std::tuple(s.low, s.high, s.triangle); });
  return sides;
}

/// Calls f(first, last) for the sides that lie on each edge.
template <class F>
void for_edges(const std::vector<Side>& sides, F&& f) {
  for (std::size_t i = 0, j = 0; i < sides.size(); i = j) {
    while (j < sides.size() && sides[j].same_ends(sides[i])) ++j;
    f(sides.begin() + static_cast<std::ptrdiff_t>(i), sides.begin() + static_cast<std::ptrdiff_t>(j));
  }
}

/// Sets of what belongs together.
struct Groups {
  std::vector<std::int32_t> parent;
  explicit Groups(std::size_t n) : parent(n) { std::iota(parent.begin(), parent.end(), 0); }
  std::int32_t find(std::int32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }
  void join(std::int32_t a, std::int32_t b) { parent[find(a)] = find(b); }
};

void find_holes(const Triangles& t, const std::vector<Side>& sides, SurfaceFaults& faults) {
  std::vector<Side> open;
  for_edges(sides, [&](auto first, auto last) {
    if (last - first == 1) open.push_back(*first);
    if (last - first > 2 && faults.shared_edges++ == 0)
      faults.shared_at = 0.5 * (t.points[first->low] + t.points[first->high]);
  });
  faults.open_edges = std::ssize(open);
  if (open.empty()) return;
  faults.open_at = 0.5 * (t.points[open[0].low] + t.points[open[0].high]);
  Groups groups(t.points.size());
  for (const Side& side : open) groups.join(side.low, side.high);
  std::unordered_map<std::int32_t, Bounds> boxes;
  for (const Side& side : open) {
    Bounds& box = boxes.try_emplace(groups.find(side.low), shapes::nothing()).first->second;
    shapes::widen(box, t.points[side.low]), shapes::widen(box, t.points[side.high]);
  }
  for (const auto& [group, box] : boxes)
    faults.largest_hole = std::max(faults.largest_hole, (box.upper - box.lower).norm());
}

/// Turns triangles so that those beside each other agree, as the larger area of each part has it. Returns the part of
/// each triangle.
std::vector<std::int32_t> agree(Triangles& t, const std::vector<Side>& sides, SurfaceFaults& faults) {
  const std::size_t n = t.corners.size();
  std::vector<std::array<std::int32_t, 3>> beside(n, {-1, -1, -1});
  std::vector<std::array<bool, 3>> differs(n);
  std::vector<std::int8_t> count(n, 0);
  for_edges(sides, [&](auto first, auto last) {
    if (last - first != 2) return;
    const Side &a = *first, &b = *(first + 1);
    for (const auto& [from, to] : {std::pair(a.triangle, b.triangle), std::pair(b.triangle, a.triangle)})
      beside[from][count[from]] = to, differs[from][count[from]++] = a.forward == b.forward;
  });
  std::vector<std::int32_t> part(n, -1), stack;
  std::vector<std::int8_t> turned(n, 0);
  for (std::int32_t seed = 0; seed < std::ssize(t.corners); ++seed) {
    if (part[seed] >= 0) continue;
    std::vector<std::int32_t> members;
    std::array<double, 2> area{};
    part[seed] = seed, stack = {seed};
    while (!stack.empty()) {
      const auto i = stack.back();
      stack.pop_back(), members.push_back(i);
      const Corners& c = t.corners[i];
      area[turned[i]] += (t.points[c[1]] - t.points[c[0]]).cross(t.points[c[2]] - t.points[c[0]]).norm();
      for (int k = 0; k < count[i]; ++k) {
        const auto j = beside[i][k];
        if (part[j] >= 0) continue;
        part[j] = seed, turned[j] = static_cast<std::int8_t>(turned[i] ^ static_cast<std::int8_t>(differs[i][k]));
        stack.push_back(j);
      }
    }
    const std::int8_t fewer = area[0] >= area[1] ? 1 : 0;
    for (const auto i : members)
      if (turned[i] == fewer) {
        if (faults.flipped++ == 0) faults.flipped_at = middle_of(t, t.corners[i]);
        std::swap(t.corners[i][1], t.corners[i][2]);
      }
  }
  return part;
}

double volume_of(const Triangles& t, const std::vector<std::int32_t>& some) {
  const Vec3 o = t.points[t.corners[some[0]][0]];
  double volume = 0;
  for (const auto i : some) {
    const Corners& c = t.corners[i];
    volume += (t.points[c[0]] - o).dot((t.points[c[1]] - o).cross(t.points[c[2]] - o)) / 6;
  }
  return volume;
}

/// Turns parts that enclose a negative volume, but for those that are the walls of a cavity in another one.
void turn_parts(Triangles& t, const std::vector<std::int32_t>& part, SurfaceFaults& faults) {
  std::unordered_map<std::int32_t, std::vector<std::int32_t>> parts;
  for (std::int32_t i = 0; i < std::ssize(part); ++i) parts[part[i]].push_back(i);
  std::vector<std::int32_t> wrong;
  for (const auto& [first, some] : parts)
    if (volume_of(t, some) < 0) wrong.push_back(first);
  if (wrong.empty()) return;
  std::ranges::sort(wrong);
  const TriangleTree tree(t);
  std::vector<std::int32_t> outer;
  for (const auto first : wrong) {
    // A wall of a cavity: just within the part, where its own winding number is -1, that of all is 0 or more.
    const Corners& c = t.corners[first];
    const Vec3 across = (t.points[c[1]] - t.points[c[0]]).cross(t.points[c[2]] - t.points[c[0]]);
    const Vec3 within = middle_of(t, c) + 1e-4 * std::sqrt(across.norm()) * across.normalized();
    if (parts.size() == 1 || tree.winding(within) < -0.5) outer.push_back(first);
  }
  for (const auto first : outer) {
    faults.inside_out = true;
    for (const auto i : parts[first]) std::swap(t.corners[i][1], t.corners[i][2]);
  }
}

}  // namespace

namespace {

/// Returns the part of each triangle.
std::vector<std::int32_t> join_up(Triangles& surface, SurfaceFaults& faults) {
  merge_points(surface);
  drop_useless(surface, faults);
  if (surface.corners.empty()) return {};
  const std::vector<Side> sides = sides_of(surface);
  find_holes(surface, sides, faults);
  return agree(surface, sides, faults);
}

}  // namespace

SurfaceFaults mend_sheet(Triangles& surface) {
  SurfaceFaults faults;
  join_up(surface, faults);
  return faults;
}

SurfaceFaults mend(Triangles& surface) {
  SurfaceFaults faults;
  const auto parts = join_up(surface, faults);
  if (surface.corners.empty()) return faults;
  turn_parts(surface, parts, faults);
  faults.crossings = count_crossings(surface, faults.crossing_at);
  return faults;
}

namespace {

double volume6(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) { return (b - a).cross(c - a).dot(d - a); }

/// The line a b passes through the inside of the triangle.
bool pierces(const Vec3& a, const Vec3& b, const std::array<Vec3, 3>& t, double least) {
  const double va = volume6(t[0], t[1], t[2], a), vb = volume6(t[0], t[1], t[2], b);
  if (!(std::min(va, vb) < -least && std::max(va, vb) > least)) return false;
  const double s0 = volume6(a, b, t[0], t[1]), s1 = volume6(a, b, t[1], t[2]), s2 = volume6(a, b, t[2], t[0]);
  return (s0 > least && s1 > least && s2 > least) || (s0 < -least && s1 < -least && s2 < -least);
}

bool pass_through(const Triangles& t, const Corners& a, const Corners& b, double least) {
  const auto points = [&](const Corners& c) { return std::array{t.points[c[0]], t.points[c[1]], t.points[c[2]]}; };
  const auto has = [](const Corners& c, std::int32_t p) { return std::ranges::find(c, p) != c.end(); };
  const auto shared = std::ranges::count_if(a, [&](auto p) { return has(b, p); });
  if (shared >= 2) return false;
  const auto any_side = [&](const Corners& from, const Corners& through) {
    for (int k = 0; k < 3; ++k) {
      const auto p = from[k], q = from[(k + 1) % 3];
      if (!has(through, p) && !has(through, q) && pierces(t.points[p], t.points[q], points(through), least))
        return true;
    }
    return false;
  };
  return any_side(a, b) || any_side(b, a);
}

}  // namespace

std::int64_t count_crossings(const Triangles& surface, Vec3& where) {
  const TriangleTree tree(surface);
  const Bounds all = tree.bounds();
  const double least = 1e-14 * std::pow((all.upper - all.lower).norm(), 3);
  std::int64_t count = 0;
  tree.for_near_pairs([&](std::int32_t i, std::int32_t j) {
    if (!pass_through(surface, surface.corners[i], surface.corners[j], least)) return;
    if (count++ == 0) where = middle_of(surface, surface.corners[i]);
  });
  return count;
}

}  // namespace cairn
