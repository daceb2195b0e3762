#include "cairn/crack/sides.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "cairn/core/lanes.hpp"
#include "cairn/crack/crossing.hpp"
#include "sheets.hpp"
#include "triangles_around.hpp"

namespace cairn {
namespace {

constexpr double point_reach = 1.5;       // cells from a point to the nodes it may touch
constexpr double longest_open_end = 2.0;  // cells by which an open end is prolonged for crossings, at most

/// The quadratic B-spline of a distance in cells.
double spline(double u) {
  u = std::abs(u);
  if (u < 0.5) return 0.75 - u * u;
  return u < 1.5 ? 0.5 * (1.5 - u) * (1.5 - u) : 0.0;
}

/// Bounds of a segment or triangle in one direction.
template <int Dim>
std::pair<double, double> extent(const std::array<Vec<Dim>, Dim>& corners, int k) {
  double lower = corners[0][k], upper = corners[0][k];
  for (int i = 1; i < Dim; ++i) lower = std::min(lower, corners[i][k]), upper = std::max(upper, corners[i][k]);
  return {lower, upper};
}

/// Whether the boxes around a line and a segment or triangle do not even touch.
template <int Dim>
bool are_apart(const Vec<Dim>& a, const Vec<Dim>& b, const std::array<Vec<Dim>, Dim>& corners) {
  for (int k = 0; k < Dim; ++k) {
    const auto [lower, upper] = extent<Dim>(corners, k);
    if (std::max(a[k], b[k]) < lower || upper < std::min(a[k], b[k])) return true;
  }
  return false;
}

/// What the line from a point to a node crosses, by point.
template <int Dim>
struct Crossed {
  int point;
  FurtherRow<Dim> row;
  std::array<double, NodeCrossings<Dim>::width> sums;
};

}  // namespace

template <int Dim>
CrackSegments<Dim>::CrackSegments(const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                                  const std::vector<Crack>& cracks) {
  if constexpr (Dim == 2) {
    const auto add = [&](int crack, const Vec<2>& a, const Vec<2>& b) {
      const Vec<2> e = (b - a).normalized();
      if (e.squaredNorm() > 0) segments_.push_back({crack, {a, b}, Vec<2>(-e.y(), e.x())});
    };
    const auto& points = patch.cracks;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Crack& crack = cracks[points[k].crack];
      if (crack.idle) continue;
      const bool joined = k + 1 < points.size() && points[k].precedes(points[k + 1]);
      const bool follows = k > 0 && points[k - 1].precedes(points[k]);
      const Vec<2>& x = points[k].plane;
      const auto beyond = [&](const Vec<2>& before) -> Vec<2> {
        const Vec<2> step = x - before;
        const double cells = step.cwiseProduct(lattice.inverse_spacing()).norm();
        return x + step * std::min(4.0, longest_open_end / std::max(cells, 1e-300));
      };
      if (joined && points[k].index == crack.ends[0] && crack.open[0] && !crack.joined[0])
        add(points[k].crack, beyond(points[k + 1].plane), x);
      if (joined) add(points[k].crack, x, points[k + 1].plane);
      if (follows && points[k].index == crack.ends[1] && crack.open[1] && !crack.joined[1])
        add(points[k].crack, x, beyond(points[k - 1].plane));
    }
  } else {
    list_triangles(patch, longest_open_end * lattice.spacing().maxCoeff(), cracks, segments_, normals_);
  }
  if (segments_.empty()) return;
  cells_ = patch.cells;
  for (int d = 0; d < Dim; ++d) --cells_.lower[d], ++cells_.upper[d];
  std::vector<Box<Dim>> reached;
  for (const Segment& segment : segments_) {
    Box<Dim> box;
    for (int d = 0; d < Dim; ++d) {
      const auto [lower, upper] = extent<Dim>(segment.corners, d);
      box.lower[d] = static_cast<int>(std::floor(lattice.scaled(d, lower) - point_reach - 0.01));
      box.upper[d] = static_cast<int>(std::floor(lattice.scaled(d, upper) + point_reach + 0.01)) + 1;
    }
    reached.push_back(intersection(box, cells_));
  }
  first_.assign(cells_.size() + 1, 0);
  for (const Box<Dim>& box : reached) for_each(box, [&](const Index<Dim>& cell) { ++first_[cells_.offset(cell) + 1]; });
  for (std::size_t c = 0; c + 1 < first_.size(); ++c) first_[c + 1] += first_[c];
  listed_.resize(first_.back());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t s = 0; s < reached.size(); ++s)
    for_each(reached[s], [&](const Index<Dim>& cell) { listed_[next[cells_.offset(cell)]++] = static_cast<int>(s); });
}

template <int Dim>
std::span<const int> CrackSegments<Dim>::near(const Vec<Dim>& x, const Lattice<Dim>& lattice) const {
  if (segments_.empty()) return {};
  Index<Dim> cell;
  for (int d = 0; d < Dim; ++d) cell[d] = static_cast<int>(std::floor(lattice.scaled(d, x[d])));
  if (!cells_.contains(cell)) return {};
  const int c = cells_.offset(cell);
  return std::span(listed_).subspan(first_[c], first_[c + 1] - first_[c]);
}

template <int Dim>
auto CrackSegments<Dim>::crossed(std::span<const int> near, const Vec<Dim>& x, const Vec<Dim>& node, int body,
                                 const std::vector<Crack>& cracks) const -> Crossings {
  Crossings found;
  for (std::size_t k = 0; k < near.size();) {
    const int crack = segments_[near[k]].crack;
    const bool cuts = cracks[crack].cuts(body);
    int sum = 0;
    Vec<Dim> normal = Vec<Dim>::Zero();
    for (; k < near.size() && segments_[near[k]].crack == crack; ++k) {
      const Segment& s = segments_[near[k]];
      if (!cuts || are_apart<Dim>(x, node, s.corners)) continue;
      const int sign = crack::crossing(x, node, s.corners);
      if (sign != 0) sum += sign, normal += s.normal;
    }
    if (sum == 0) continue;
    const int n = found.sides.size();
    if (n == SideSet::most) {
      found.crowded = true;
      break;
    }
    found.sides = found.sides.with(crack);
    double* at = &found.sums[n * NodeCrossings<Dim>::each];
    at[NodeCrossings<Dim>::sign] = sum > 0 ? 1 : -1;
    Eigen::Map<Vec<Dim>>(at + NodeCrossings<Dim>::normal) = normal.normalized();
  }
  return found;
}

template <int Dim>
double CrackSegments<Dim>::first_meeting(const Vec<Dim>& x, const Vec<Dim>& y, int crack, double skipped) const {
  double first = std::numeric_limits<double>::infinity();
  if constexpr (Dim == 2)
    for (const Segment& s : segments_) {
      const auto& [a, b] = s.corners;
      const bool beside_tip = s.crack == crack && std::min((a - x).norm(), (b - x).norm()) < skipped;
      if (beside_tip || crack::crossing(x, y, a, b) == 0) continue;
      const double away = (x - a).dot(s.normal), beyond = (y - a).dot(s.normal);
      first = std::min(first, away / (away - beyond));
    }
  return first;
}

template <int Dim>
Vec<Dim> CrackSegments<Dim>::normal_near(int c, const Vec<Dim>& x) const {
  double nearest = std::numeric_limits<double>::infinity();
  Vec<Dim> normal = Vec<Dim>::Zero(), sum = Vec<Dim>::Zero();
  for (const Segment& s : segments_) {
    if (s.crack != c) continue;
    const Vec<Dim>&a = s.corners[0], e = s.corners[1] - a;
    const double along = std::clamp((x - a).dot(e) / e.squaredNorm(), 0.0, 1.0);
    const double squared = (a + along * e - x).squaredNorm();
    // A crack point belongs to two segments: the mean of their normals.
    const bool equal = std::abs(squared - nearest) <= 1e-24 * e.squaredNorm() || squared == nearest;
    if (equal) sum += s.normal, normal = sum;
    if (!equal && squared < nearest) nearest = squared, normal = sum = s.normal;
  }
  return normal.squaredNorm() > 0 ? Vec<Dim>(normal.normalized()) : normal;
}

template <int Dim>
Vec<Dim> CrackSegments<Dim>::normal_at(const CrackPoint<Dim>& point) const {
  if constexpr (Dim == 2) return normal_near(point.crack, point.plane);
  const auto name = [](const auto& p) { return std::tie(p.crack, p.image, p.index); };
  const auto at = std::lower_bound(normals_.begin(), normals_.end(), point,
                                   [&](const PointNormal& a, const CrackPoint<Dim>& b) { return name(a) < name(b); });
  return at != normals_.end() && name(*at) == name(point) ? at->normal : Vec<Dim>(Vec<Dim>::Zero());
}

template <int Dim>
double CrackSegments<Dim>::Segment::distance_to(const Vec<Dim>& x) const {
  const auto to_line = [&](const Vec<Dim>& a, const Vec<Dim>& b) {
    const Vec<Dim> e = b - a;
    return (a + std::clamp((x - a).dot(e) / e.squaredNorm(), 0.0, 1.0) * e - x).norm();
  };
  double nearest = to_line(corners[0], corners[1]);
  if constexpr (Dim == 3) {
    bool above = true;
    for (int k = 0; k < 3; ++k) {
      const Vec<3>&a = corners[k], b = corners[(k + 1) % 3];
      nearest = std::min(nearest, to_line(a, b)), above = above && normal.dot((b - a).cross(x - a)) >= 0;
    }
    if (above) nearest = std::min(nearest, std::abs(normal.dot(x - corners[0])));
  }
  return nearest;
}

namespace {

/// Appends what the lines from a piece's points to nodes cross, by ascending point. Returns the nodes that had more
/// than two cracks to a point.
template <int Dim>
int find_crossings(const Piece<Dim>& piece, const CrackSegments<Dim>& segments, const std::vector<Crack>& cracks,
                   const Lattice<Dim>& lattice, std::vector<Crossed<Dim>>& all) {
  int crowded = 0;
  for (int p = 0; p < piece.points.size(); ++p) {
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) x[d] = piece.points.column(d)[p];
    const auto near = segments.near(x, lattice);
    if (near.empty()) continue;
    std::optional<TrianglesAround> triangles;
    if constexpr (Dim == 3) {
      const auto cuts = [&](int crack) { return cracks[crack].cuts(piece.body); };
      triangles.emplace(segments, near, x, (point_reach + 1e-6) * lattice.spacing(), cuts);
      if (triangles->empty()) continue;
    }
    Box<Dim> around;
    for (int d = 0; d < Dim; ++d) {
      const double xi = lattice.scaled(d, x[d]);
      around.lower[d] = static_cast<int>(std::ceil(xi - point_reach - 1e-9));
      around.upper[d] = static_cast<int>(std::floor(xi + point_reach + 1e-9)) + 1;
    }
    for_each(intersection(around, piece.nodes.box), [&](const Index<Dim>& place) {
      Vec<Dim> node;
      double weight = piece.points.column(PointColumns<Dim>::volume)[p];
      for (int d = 0; d < Dim; ++d) {
        node[d] = lattice.node_position(d, place[d]);
        weight *= spline(lattice.scaled(d, x[d]) - place[d]);
      }
      auto listed = near;
      if constexpr (Dim == 3) listed = triangles->towards(node);
      auto crossed = segments.crossed(listed, x, node, piece.body, cracks);
      crowded += crossed.crowded;
      if (crossed.sides.empty()) return;
      for (double& sum : crossed.sums) sum *= weight;
      all.push_back({p, {place, crossed.sides, true}, crossed.sums});
    });
  }
  return crowded;
}

/// The further rows of a piece from what its lines cross, and each point's way to its rows.
template <int Dim>
void lay_rows(Piece<Dim>& piece, const Lattice<Dim>& lattice, const std::vector<Crossed<Dim>>& all) {
  if (all.empty()) return;
  FurtherRows<Dim>& further = piece.nodes.further;
  for (const auto& c : all) further.rows.push_back(c.row);
  std::sort(further.rows.begin(), further.rows.end());
  further.rows.erase(std::unique(further.rows.begin(), further.rows.end()), further.rows.end());
  constexpr int width = NodeCrossings<Dim>::width;
  further.crossings.assign(further.rows.size() * width, 0.0);
  further.scratch = lane_count * (Dim == 2 ? 9 : 27);
  for (const auto& c : all) {
    const int row = further.find(c.row.place, c.row.sides), block = c.point / lane_count * lane_count;
    for (int i = 0; i < width; ++i) further.crossings[static_cast<std::size_t>(row) * width + i] += c.sums[i];
    if (further.blocks.empty() || further.blocks.back() != block)
      further.blocks.push_back(block), further.points.resize(further.points.size() + lane_count);
    PointSides<Dim>& point = further.points[further.points.size() - lane_count + c.point % lane_count];
    Index<Dim> inside = c.row.place;
    for (int d = 0; d < Dim; ++d) {
      point.first[d] = static_cast<int>(std::floor(lattice.scaled(d, piece.points.column(d)[c.point]) + 0.5)) - 2;
      inside[d] -= point.first[d];
    }
    int at = 0;
    for (int d = Dim - 1; d >= 0; --d) at = at * PointSides<Dim>::extent + inside[d];
    point.row[at] = row;
  }
}

}  // namespace

template <int Dim>
int find_sides(Piece<Dim>& piece, const CrackSegments<Dim>& segments, const std::vector<Crack>& cracks,
               const Lattice<Dim>& lattice) {
  piece.nodes.further.clear();
  std::vector<Crossed<Dim>> all;
  const int crowded = find_crossings(piece, segments, cracks, lattice, all);
  lay_rows(piece, lattice, all);
  return crowded;
}

template class CrackSegments<2>;
template class CrackSegments<3>;
template int find_sides(Piece<2>&, const CrackSegments<2>&, const std::vector<Crack>&, const Lattice<2>&);
template int find_sides(Piece<3>&, const CrackSegments<3>&, const std::vector<Crack>&, const Lattice<3>&);

}  // namespace cairn
