#include "cairn/body/loops.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {
namespace {

/// 0 where all edges lie at one height, so that all of them are in the first band.
double bands_per_length(std::size_t bands, const auto& bounds) {
  const double scale = static_cast<double>(bands) / (bounds.upper.y() - bounds.lower.y());
  return std::isfinite(scale) ? scale : 0;
}

}  // namespace

Loops::Loops(const std::vector<std::vector<Vec3>>& lines) : bounds_(shapes::nothing()) {
  for (const auto& line : lines) add_edges(shapes::without_repeated(line), edges_);
  for (const auto& edge : edges_) shapes::widen(bounds_, edge.from);
  if (edges_.empty()) return;
  bands_.resize(std::clamp<std::size_t>(edges_.size(), 1, 4096));
  const double low = bounds_.lower.y(), scale = bands_per_length(bands_.size(), bounds_);
  const auto at = [&](double y) { return std::clamp<double>((y - low) * scale, 0, double(bands_.size() - 1)); };
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const auto [first, last] = std::minmax({at(edges_[e].from.y()), at(edges_[e].to.y())});
    for (auto b = static_cast<std::size_t>(first); b <= static_cast<std::size_t>(last); ++b)
      bands_[b].push_back(static_cast<std::int32_t>(e));
  }
  measure();
  measure_thickness();
}

const std::vector<std::int32_t>& Loops::band(double y) const {
  const double low = bounds_.lower.y(), scale = bands_per_length(bands_.size(), bounds_);
  return bands_[static_cast<std::size_t>(std::clamp<double>((y - low) * scale, 0, double(bands_.size() - 1)))];
}

bool Loops::holds(const Vec3& x) const {
  for (int k = 0; k < 2; ++k)
    if (!(x[k] >= bounds_.lower[k] && x[k] <= bounds_.upper[k])) return false;
  bool in = false;
  for (const std::int32_t e : band(x.y())) {
    const Vec3 &a = edges_[e].from, &b = edges_[e].to;
    if ((a.y() > x.y()) == (b.y() > x.y())) continue;
    const double cross = (b.x() - a.x()) * (x.y() - a.y()) - (b.y() - a.y()) * (x.x() - a.x());
    if ((cross > 0) == (b.y() > a.y())) in = !in;
  }
  return in;
}

/// Area and centroid by bands of x: each loop counts with the sign of what lies beside it, so that holes are taken off
/// whichever way they run.
void Loops::measure() {
  std::size_t first = 0;
  Vec3 moment = Vec3::Zero();
  const Vec3 middle = 0.5 * (bounds_.lower + bounds_.upper);
  while (first < edges_.size()) {
    std::size_t end = first;
    double area = 0;
    Vec3 own = Vec3::Zero();
    do {
      const Vec3 a = edges_[end].from - middle, b = edges_[end].to - middle;
      const double part = 0.5 * (a.x() * b.y() - a.y() * b.x());
      area += part, own += part / 3 * (a + b);
    } while (edges_[end++].next != first);
    // Whether the loop's left side is filled, beside its longest edge.
    const auto longest = std::max_element(
        edges_.begin() + first, edges_.begin() + end,
        [](const auto& a, const auto& b) { return (a.to - a.from).squaredNorm() < (b.to - b.from).squaredNorm(); });
    const Vec3 along = longest->to - longest->from;
    const Vec3 left = 0.5 * (longest->from + longest->to) + 1e-6 * Vec3(-along.y(), along.x(), 0);
    const double sign = holds(left) ? 1 : -1;
    area_ += sign * area, moment += sign * own;
    first = end;
  }
  if (area_ > 0) centroid_ = middle + moment / area_;
}

void Loops::measure_thickness() {
  constexpr std::size_t most = 500;
  constexpr double rank = 0.05;
  std::vector<std::pair<double, double>> found;  // thickness, length of the edge
  const std::size_t stride = std::max<std::size_t>(1, edges_.size() / most);
  double total = 0;
  for (std::size_t e = 0; e < edges_.size(); e += stride) {
    const Vec3 along = edges_[e].to - edges_[e].from, from = 0.5 * (edges_[e].from + edges_[e].to);
    Vec3 inward = Vec3(-along.y(), along.x(), 0).normalized();
    if (!holds(from + 1e-6 * along.norm() * inward)) inward = -inward;
    double nearest = shapes::infinity;
    for (const auto& other : edges_) {
      const Vec3 a = other.from - from, d = other.to - other.from;
      const double across = inward.x() * d.y() - inward.y() * d.x();
      if (across == 0) continue;
      const double t = (a.x() * d.y() - a.y() * d.x()) / across, s = (a.x() * inward.y() - a.y() * inward.x()) / across;
      if (t > 1e-9 * along.norm() && s >= 0 && s <= 1) nearest = std::min(nearest, t);
    }
    if (std::isfinite(nearest)) found.emplace_back(nearest, along.norm()), total += along.norm();
  }
  std::ranges::sort(found);
  double passed = 0;
  for (const auto& [thickness, length] : found) {
    thickness_ = thickness;
    if ((passed += length) > rank * total) break;
  }
}

}  // namespace cairn
