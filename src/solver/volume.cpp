#include "cairn/solver/volume.hpp"

#include <algorithm>
#include <cmath>

#include "cairn/body/pack.hpp"
#include "cairn/grid/box.hpp"

namespace cairn {
namespace {

/// The part of space to take samples of, and whether the shape meets its own images there.
struct Window {
  Bounds bounds;
  std::array<int, 3> images{};  // that may reach into it, on either side
  bool exact = true;            // no image and no samples are needed for a box
};

Window window_of(const Shape& shape, const Domain& d) {
  Window w{bounds(shape), {}, true};
  Bounds& b = w.bounds;
  for (int k = 0; k < d.dimension; ++k) {
    const bool finite = std::isfinite(b.lower[k]) && std::isfinite(b.upper[k]);
    const double length = d.upper[k] - d.lower[k], width = b.upper[k] - b.lower[k];
    if (d.periodic[k] && finite && width <= length) continue;
    if (d.periodic[k] && finite) {
      constexpr double most_images = 100;
      w.images[k] = static_cast<int>(std::min(most_images, std::ceil((width + length) / length)));
      w.exact = false;
      b.lower[k] = d.lower[k], b.upper[k] = d.upper[k];
      continue;
    }
    b.lower[k] = std::max(b.lower[k], d.lower[k]), b.upper[k] = std::min(b.upper[k], d.upper[k]);
  }
  return w;
}

bool any_image_holds(const Shape& shape, const Vec3& x, const Domain& d, const std::array<int, 3>& images) {
  for (int k = -images[2]; k <= images[2]; ++k)
    for (int j = -images[1]; j <= images[1]; ++j)
      for (int i = -images[0]; i <= images[0]; ++i)
        if (contains(shape, x - (d.upper - d.lower).cwiseProduct(Vec3(i, j, k)))) return true;
  return false;
}

/// No face of the domain cuts the box.
bool is_within(const Bounds& b, const Domain& d) {
  for (int k = 0; k < d.dimension; ++k)
    if (!d.periodic[k] && (b.lower[k] < d.lower[k] || b.upper[k] > d.upper[k])) return false;
  return true;
}

}  // namespace

int samples_for(std::size_t bodies, int dimension) {
  constexpr double all = 2e7;
  return static_cast<int>(
      std::clamp(std::pow(all / static_cast<double>(std::max<std::size_t>(1, bodies)), 1.0 / dimension), 24.0,
                 dimension == 2 ? 256.0 : 64.0));
}

double volume_of(const Shape& shape, const Domain& d, int samples) {
  const auto* ball = std::get_if<Ball>(&shape);
  const Window w = window_of(shape, d);
  if (ball && w.exact) return volume_inside(d.dimension, ball->centre, ball->radius, d.lower, d.upper, d.periodic);
  if (const double known = known_volume(shape); known >= 0 && w.exact && is_within(bounds(shape), d)) return known;
  Vec3 step = Vec3::Zero();
  double whole = 1;
  for (int k = 0; k < d.dimension; ++k) whole *= step[k] = std::max(0.0, w.bounds.upper[k] - w.bounds.lower[k]);
  const auto* box = std::get_if<BoxShape>(&shape);
  if (whole == 0 || (box && box->angle == 0 && w.exact)) return whole;
  std::int64_t inside = 0;
  for (int k = 0; k < (d.dimension == 3 ? samples : 1); ++k)
    for (int j = 0; j < samples; ++j)
      for (int i = 0; i < samples; ++i) {
        Vec3 x = w.bounds.lower + step.cwiseProduct(Vec3(i + 0.5, j + 0.5, k + 0.5) / samples);
        if (d.dimension == 2) x.z() = 0;
        inside += any_image_holds(shape, x, d, w.images);
      }
  return whole * static_cast<double>(inside) / std::pow(samples, d.dimension);
}

}  // namespace cairn
