// Crack points beside no material.

#include "cairn/crack/faces.hpp"

namespace cairn {
namespace {

/// The crack point with material beside it that is nearest to the k-th, of those of the same crack; k where there is
/// none.
std::ptrdiff_t nearest_filled(const std::vector<CrackPoint<3>>& points, std::ptrdiff_t k) {
  std::ptrdiff_t nearest = k;
  double least = std::numeric_limits<double>::infinity();
  for (std::ptrdiff_t j = 0; j < std::ssize(points); ++j) {
    const double squared = (points[j].plane - points[k].plane).squaredNorm();
    if (points[j].crack != points[k].crack || points[j].image != points[k].image || !points[j].filled) continue;
    if (squared < least) least = squared, nearest = j;
  }
  return nearest;
}

}  // namespace

template <int Dim>
void borrow_face_velocities(std::vector<CrackPoint<Dim>>& points) {
  const auto n = static_cast<std::ptrdiff_t>(points.size());
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    if (!points[k].own || points[k].filled) continue;
    const auto on_line = [&](std::ptrdiff_t j) {
      return j >= 0 && j < n && points[j].crack == points[k].crack && points[j].image == points[k].image;
    };
    const auto nearest = [&]() -> std::ptrdiff_t {
      if constexpr (Dim == 3) return nearest_filled(points, k);
      for (std::ptrdiff_t away = 1; on_line(k - away) || on_line(k + away); ++away)
        for (const std::ptrdiff_t j : {k - away, k + away})
          if (on_line(j) && points[j].filled) return j;
      return k;
    }();
    points[k].lower_velocity = points[nearest].lower_velocity,
    points[k].upper_velocity = points[nearest].upper_velocity;
  }
}

template void borrow_face_velocities(std::vector<CrackPoint<2>>&);
template void borrow_face_velocities(std::vector<CrackPoint<3>>&);

}  // namespace cairn
