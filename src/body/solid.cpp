// Where surfaces have their inside.

#include "cairn/body/solid.hpp"

#include <algorithm>
#include <cmath>

#include "triangle_tree.hpp"

namespace cairn {
namespace {

/// A line from p to x, and the triangles it passes. Signs of volumes are those of the same numbers in the same order
/// for both triangles at an edge, so that the line never slips through between them.
class Passage {
 public:
  Passage(const std::vector<Vec3>& points, const Vec3& p, const Vec3& x) : points_(points), p_(p), way_(x - p), x_(x) {}

  /// 1 where the line enters through the triangle, -1 where it leaves, 0 where it does not pass.
  int through(const std::array<std::int32_t, 3>& c) const {
    const bool from = beyond(c, p_), to = beyond(c, x_);
    if (from == to) return 0;
    const bool a = left(c[0], c[1]), b = left(c[1], c[2]);
    if (a != b || b != left(c[2], c[0])) return 0;
    return from ? 1 : -1;
  }

 private:
  /// On the outer side of the triangle's plane; the corners in the order of their numbers.
  bool beyond(std::array<std::int32_t, 3> c, const Vec3& x) const {
    bool even = true;
    for (const auto& [i, j] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)})
      if (c[i] > c[j]) std::swap(c[i], c[j]), even = !even;
    const Vec3 &a = points_[c[0]], &b = points_[c[1]], &d = points_[c[2]];
    return ((b - a).cross(d - a).dot(x - a) >= 0) == even;
  }
  bool left(std::int32_t i, std::int32_t j) const {
    const bool forward = i < j;
    const Vec3 a = points_[forward ? i : j] - p_, b = points_[forward ? j : i] - p_;
    return (a.cross(b).dot(way_) >= 0) == forward;
  }

  const std::vector<Vec3>& points_;
  Vec3 p_, way_, x_;
};

}  // namespace

struct Solid::State {
  Triangles triangles;
  bool closed;
  TriangleTree tree;
  Bounds box;
  Vec3 middle = Vec3::Zero();
  double volume = 0, thickness = 0;
  std::array<int, 3> cells{};
  Vec3 cell = Vec3::Zero();
  std::vector<std::int32_t> start, of_cell;    // triangles of a cell: of_cell[start[i]] to of_cell[start[i + 1]]
  static constexpr std::int8_t unknown = 127;  // until it is asked for
  mutable std::vector<std::int8_t> around;     // winding number at the place of a cell

  State(Triangles t, bool is_closed) : triangles(std::move(t)), closed(is_closed), tree(triangles) {
    box = tree.bounds();
    measure();
    measure_thickness();
    sort_into_cells();
  }

  void measure() {
    const Vec3 origin = 0.5 * (box.lower + box.upper);
    Vec3 moment = Vec3::Zero();
    for (const auto& c : triangles.corners) {
      const Vec3 a = triangles.points[c[0]] - origin, b = triangles.points[c[1]] - origin,
                 d = triangles.points[c[2]] - origin;
      const double part = a.dot(b.cross(d)) / 6;
      volume += part, moment += part / 4 * (a + b + d);
    }
    middle = volume > 0 ? (origin + moment / volume).eval() : origin;
  }

  void measure_thickness() {
    constexpr std::size_t most = 2000;
    constexpr double rank = 0.05;
    std::vector<std::pair<double, double>> found;  // thickness, area
    double total = 0;
    const std::size_t stride = std::max<std::size_t>(1, triangles.corners.size() / most);
    for (std::size_t i = 0; i < triangles.corners.size(); i += stride) {
      const auto& c = triangles.corners[i];
      const Vec3 &a = triangles.points[c[0]], &b = triangles.points[c[1]], &d = triangles.points[c[2]];
      const Vec3 area = (b - a).cross(d - a);
      const double size = area.norm();
      if (size == 0) continue;
      const double depth = tree.first_hit((a + b + d) / 3, -area / size, 1e-6 * std::sqrt(size));
      if (std::isfinite(depth)) found.emplace_back(depth, size), total += size;
    }
    std::ranges::sort(found);
    double passed = 0;
    for (const auto& [depth, size] : found) {
      thickness = depth;
      if ((passed += size) > rank * total) break;
    }
  }

  Vec3 place(std::size_t i) const {
    // Away from the middle, where lines and planes of made surfaces like to be.
    const auto x = static_cast<double>(i % cells[0]), y = static_cast<double>(i / cells[0] % cells[1]),
               z = static_cast<double>(i / (std::size_t(cells[0]) * cells[1]));
    return box.lower + Vec3(x + 0.4873, y + 0.5179, z + 0.5061).cwiseProduct(cell);
  }

  /// Calls f(cell) for the cells that a triangle may reach into.
  template <class F>
  void for_cells(const std::array<std::int32_t, 3>& c, F&& f) const {
    Bounds b = shapes::nothing();
    for (const auto corner : c) shapes::widen(b, triangles.points[corner]);
    std::array<int, 3> low, high;
    for (int k = 0; k < 3; ++k) {
      const auto at = [&](double x) { return std::clamp((x - box.lower[k]) / cell[k], 0.0, cells[k] - 1.0); };
      low[k] = static_cast<int>(at(b.lower[k] - 1e-9 * cell[k])),
      high[k] = static_cast<int>(at(b.upper[k] + 1e-9 * cell[k]));
    }
    const Vec3 normal =
        (triangles.points[c[1]] - triangles.points[c[0]]).cross(triangles.points[c[2]] - triangles.points[c[0]]);
    const double reach = 0.5 * normal.cwiseAbs().dot(cell) * (1 + 1e-6);
    for (int z = low[2]; z <= high[2]; ++z)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int x = low[0]; x <= high[0]; ++x) {
          const Vec3 centre = box.lower + Vec3(x + 0.5, y + 0.5, z + 0.5).cwiseProduct(cell);
          if (std::abs(normal.dot(centre - triangles.points[c[0]])) <= reach)
            f((std::size_t(z) * cells[1] + y) * cells[0] + x);
        }
  }

  /// About as many cells along the surface as there are triangles.
  void sort_into_cells() {
    constexpr double most = 256;
    const Vec3 extent = box.upper - box.lower;
    const double area = 2 * (extent.x() * extent.y() + extent.y() * extent.z() + extent.z() * extent.x());
    const double side =
        std::max(std::sqrt(area / static_cast<double>(triangles.corners.size() + 500)), extent.maxCoeff() / most);
    std::size_t count = 1;
    for (int k = 0; k < 3; ++k) {
      cells[k] = std::max(1, static_cast<int>(std::ceil(extent[k] / side)));
      cell[k] = std::max(extent[k], 1e-12 * extent.maxCoeff()) / cells[k];
      count *= cells[k];
    }
    start.assign(count + 1, 0);
    for (const auto& c : triangles.corners) for_cells(c, [&](std::size_t i) { ++start[i + 1]; });
    for (std::size_t i = 0; i < count; ++i) start[i + 1] += start[i];
    of_cell.resize(start[count]);
    std::vector<std::int32_t> filled(start.begin(), start.end() - 1);
    for (std::int32_t t = 0; t < std::ssize(triangles.corners); ++t)
      for_cells(triangles.corners[t], [&](std::size_t i) { of_cell[filled[i]++] = t; });
    around.assign(count, unknown);
  }

  int winding_at(std::size_t i) const {
    if (around[i] == unknown)
      around[i] = static_cast<std::int8_t>(std::clamp(std::round(tree.winding(place(i))), -100.0, 100.0));
    return around[i];
  }
};

Solid::Solid(Triangles triangles, bool closed) : state_(std::make_unique<State>(std::move(triangles), closed)) {}
Solid::~Solid() = default;

bool Solid::holds(const Vec3& x) const {
  const State& s = *state_;
  std::size_t i = 0;
  for (int k = 2; k >= 0; --k) {
    const double at = (x[k] - s.box.lower[k]) / s.cell[k];
    if (!(at >= 0 && at <= s.cells[k])) return false;
    i = i * s.cells[k] + static_cast<std::size_t>(std::min<double>(at, s.cells[k] - 1));
  }
  const auto first = s.start[i], last = s.start[i + 1];
  if (!s.closed) return s.tree.winding(x) > 0.5;
  int winding = s.winding_at(i);
  if (first == last) return winding > 0;
  const Passage passage(s.triangles.points, s.place(i), x);
  for (auto k = first; k < last; ++k) winding += passage.through(s.triangles.corners[s.of_cell[k]]);
  return winding > 0;
}

const Bounds& Solid::bounds() const { return state_->box; }
const std::vector<Vec3>& Solid::points() const { return state_->triangles.points; }
std::size_t Solid::size() const { return state_->triangles.corners.size(); }
double Solid::volume() const { return state_->volume; }
Vec3 Solid::centroid() const { return state_->middle; }
double Solid::thickness() const { return state_->thickness; }
double Solid::winding(const Vec3& x) const { return state_->tree.winding(x); }

}  // namespace cairn
