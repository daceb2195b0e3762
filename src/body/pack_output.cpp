// What a pack delivers: the parts of its grains inside the box, and the grain table.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "pack_detail.hpp"

namespace cairn {
namespace {

constexpr double pi = std::numbers::pi;

/// Area of the unit disk where x <= a.
double disk_below(double a) {
  if (a <= -1) return 0;
  if (a >= 1) return pi;
  return pi / 2 + a * std::sqrt(1 - a * a) + std::asin(a);
}

/// Area of the unit disk where x <= a and y <= b.
double disk_quadrant(double a, double b) {
  if (a <= -1 || b <= -1) return 0;
  if (a >= 1) return disk_below(b);
  if (b >= 1) return disk_below(a);
  if (a * a + b * b <= 1) return 0.5 * (disk_below(a) + disk_below(b)) + a * b - pi / 4;
  if (a > 0 && b > 0) return disk_below(a) + disk_below(b) - pi;
  if (a > 0) return disk_below(b);
  return b > 0 ? disk_below(a) : 0.0;
}

/// Area of a disk inside a rectangle whose sides lie at `low` and `high` from its centre.
double disk_inside(double radius, const double* low, const double* high) {
  const double a0 = low[0] / radius, a1 = high[0] / radius, b0 = low[1] / radius, b1 = high[1] / radius;
  return radius * radius *
         (disk_quadrant(a1, b1) - disk_quadrant(a0, b1) - disk_quadrant(a1, b0) + disk_quadrant(a0, b0));
}

/// Volume of a sphere inside a box: areas of its slices, by Simpson's rule in the latitude.
double sphere_inside(double radius, const double* low, const double* high) {
  constexpr int parts = 400;
  const double from = std::asin(std::clamp(low[2] / radius, -1.0, 1.0));
  const double to = std::asin(std::clamp(high[2] / radius, -1.0, 1.0));
  double sum = 0;
  for (int i = 0; i <= parts; ++i) {
    const double cosine = std::cos(from + (to - from) * i / parts);
    const double weight = i == 0 || i == parts ? 1 : i % 2 ? 4 : 2;
    if (cosine > 1e-9) sum += weight * disk_inside(radius * cosine, low, high) * radius * cosine;
  }
  return sum * (to - from) / (3 * parts);
}

const char* name(SizeType type) {
  constexpr const char* names[] = {"uniform", "lognormal", "list", "fit"};
  return names[static_cast<int>(type)];
}

template <class T>
std::string row(std::size_t n, const T& values) {
  std::string text;
  for (std::size_t i = 0; i < n; ++i) text += fmt::format("{}{}", i ? ", " : "", values[i]);
  return text;
}

std::string sizes_line(const SizeSpec& s) {
  std::string text = fmt::format("type = \"{}\"", name(s.type));
  const auto add = [&](const char* key, double value) {
    if (value != 0) text += fmt::format(", {} = {}", key, value);
  };
  if (s.type == SizeType::list) {
    text += fmt::format(", diameters = [{}]", row(s.diameters.size(), s.diameters));
    if (!s.weights.empty()) text += fmt::format(", weights = [{}]", row(s.weights.size(), s.weights));
  } else {
    add("min", s.min);
    add("max", s.max);
    add("mean", s.type == SizeType::uniform ? 0.0 : s.mean);
    add("sigma", s.type == SizeType::lognormal ? s.sigma : 0.0);
  }
  if (s.scale) text += ", scale = true";
  return text;
}

std::string comments(const Pack& pack, const PackSpec& spec) {
  const int dim = spec.dimension;
  std::string text = fmt::format("# {} grains, made by cairn pack from this spec:\n", pack.radius.size());
  text += fmt::format("#   dimension = {}, lower = [{}], upper = [{}], periodic = [{}], walls = \"{}\"\n", dim,
                      row(dim, spec.lower), row(dim, spec.upper), row(dim, spec.periodic),
                      spec.walls == PackWalls::inside ? "inside" : "overlap");
  text += "#   ";
  if (spec.count) text += fmt::format("count = {}, ", spec.count);
  if (spec.fraction > 0) text += fmt::format("fraction = {}, ", spec.fraction);
  text += fmt::format("seed = {}, max_overlap = {}\n", spec.seed, spec.max_overlap);
  text += fmt::format("#   sizes: {}\n", sizes_line(spec.sizes));
  const auto [least, largest] = std::minmax_element(pack.radius.begin(), pack.radius.end());
  text += fmt::format(
      "# delivered: fraction {:.5f}, diameters {:.6g} to {:.6g}, mean {:.6g}, largest overlap {:.2g} of the smaller "
      "radius\n",
      pack.fraction, 2 * *least, 2 * *largest, pack.mean_diameter, pack.max_overlap);
  return text;
}

}  // namespace

double volume_inside(int dimension, const Vec3& centre, double radius, const Vec3& lower, const Vec3& upper,
                     const std::array<bool, 3>& whole) {
  double low[3], high[3];
  bool cut = false;
  for (int k = 0; k < 3; ++k) {
    const bool open = k >= dimension || whole[k];
    low[k] = open ? -radius : std::max(-radius, lower[k] - centre[k]);
    high[k] = open ? radius : std::min(radius, upper[k] - centre[k]);
    if (high[k] <= low[k]) return 0;
    cut = cut || low[k] > -radius || high[k] < radius;
  }
  if (!cut) return pack_detail::grain_volume(dimension, 2 * radius);
  return dimension == 2 ? disk_inside(radius, low, high) : sphere_inside(radius, low, high);
}

std::string pack_table(const Pack& pack, const PackSpec& spec) {
  std::string text = comments(pack, spec) + (spec.dimension == 2 ? "x,y,r\n" : "x,y,z,r\n");
  for (std::size_t i = 0; i < pack.radius.size(); ++i) {
    for (int k = 0; k < spec.dimension; ++k) text += fmt::format("{},", pack.centre[i][k]);
    text += fmt::format("{}\n", pack.radius[i]);
  }
  return text;
}

}  // namespace cairn
