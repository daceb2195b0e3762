// Diameters of a packing: quantiles of the distribution asked for, so that its moments do not depend on chance.

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <numeric>

#include "pack_detail.hpp"

namespace cairn::pack_detail {
namespace {

constexpr int table_size = 4000;
constexpr int nominal_count = 20000;  // sample that stands for the whole distribution while the count is unknown

/// Cumulative distribution on logarithmically spaced diameters.
struct Table {
  std::vector<double> d, density, cumulative;
};

Table tabulate(double low, double high, const std::function<double(double)>& log_density) {
  Table t;
  t.d.resize(table_size);
  t.density.resize(table_size);
  t.cumulative.assign(table_size, 0.0);
  for (int i = 0; i < table_size; ++i) {
    t.d[i] = low * std::pow(high / low, i / (table_size - 1.0));
    t.density[i] = log_density(t.d[i]);
  }
  t.d.back() = high;
  const double peak = *std::max_element(t.density.begin(), t.density.end());
  for (double& p : t.density) p = std::exp(p - peak);
  for (int i = 1; i < table_size; ++i) {
    t.cumulative[i] = t.cumulative[i - 1] + 0.5 * (t.density[i] + t.density[i - 1]) * (t.d[i] - t.d[i - 1]);
  }
  const double total = t.cumulative.back();
  for (double& c : t.cumulative) c /= total;
  for (double& p : t.density) p /= total;
  return t;
}

/// `ends`: the first and last quantiles are the ends of the range; otherwise the midpoints of equal shares.
std::vector<double> quantiles(const Table& t, int n, bool ends) {
  std::vector<double> d(n);
  std::size_t at = 1;
  for (int i = 0; i < n; ++i) {
    const double q = ends && n > 1 ? i / (n - 1.0) : (i + 0.5) / n;
    while (at + 1 < t.cumulative.size() && t.cumulative[at] < q) ++at;
    const double below = t.cumulative[at - 1], share = t.cumulative[at] - below;
    const double f = share > 0 ? std::clamp((q - below) / share, 0.0, 1.0) : 0.0;
    d[i] = t.d[at - 1] + f * (t.d[at] - t.d[at - 1]);
  }
  return d;
}

double mean_power(const std::vector<double>& d, int power) {
  double sum = 0;
  for (double v : d) sum += power == 1 ? v : power == 2 ? v * v : v * v * v;
  return sum / static_cast<double>(d.size());
}

/// The parameter in [low, high] at which the mean of `draw(parameter)`, which grows with it, is `mean`.
std::vector<double> solve_mean(double low, double high, double mean,
                               const std::function<std::vector<double>(double)>& draw) {
  std::vector<double> d;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    d = draw(middle);
    const double reached = mean_power(d, 1);
    if (std::abs(reached - mean) < 1e-12 * mean) break;
    (reached < mean ? low : high) = middle;
  }
  return d;
}

std::vector<double> draw_lognormal(const SizeSpec& s, int n) {
  const double low = s.min > 0 ? s.min : s.mean * std::exp(-8 * s.sigma);
  const double high = s.max > 0 ? s.max : s.mean * std::exp(8 * s.sigma);
  const double centre = std::log(s.mean), room = 10 * s.sigma * s.sigma + 10 * s.sigma + 1;
  return solve_mean(centre - room, centre + room, s.mean, [&](double mu) {
    const auto log_density = [&](double d) {
      const double u = (std::log(d) - mu) / s.sigma;
      return -0.5 * u * u - std::log(d);
    };
    return quantiles(tabulate(low, high, log_density), n, false);
  });
}

/// Power law d^-m cut to [min, max], its exponent chosen for the mean: the fit where nothing fixes the width.
std::vector<double> draw_power_law(const SizeSpec& s, int n) {
  return solve_mean(-60, 60, s.mean, [&](double m) {
    return quantiles(tabulate(s.min, s.max, [&](double d) { return m * std::log(d / s.mean); }), n, true);
  });
}

/// Density d^-(D+1) exp(a d + b d^D) on [min, max] with the given means of d and d^D (both relative to the mean
/// diameter): d^-(D+1) fills every octave of size with the same area or volume, and the exponential is the
/// distribution nearest to it, by relative entropy, that has these means. Newton on its convex dual.
std::optional<Table> tilt(const SizeSpec& s, int dim, const Eigen::Vector2d& means, Eigen::Vector2d& lambda) {
  const auto powers = [&](double d) { return Eigen::Vector2d(d / s.mean, std::pow(d / s.mean, dim)); };
  const auto make = [&](const Eigen::Vector2d& l) {
    return tabulate(s.min, s.max, [&](double d) { return l.dot(powers(d)) - (dim + 1) * std::log(d / s.mean); });
  };
  const auto moments = [&](const Table& t, Eigen::Matrix2d& covariance) {
    Eigen::Vector2d first = Eigen::Vector2d::Zero();
    covariance.setZero();
    for (int i = 1; i < table_size; ++i) {
      const double share = t.cumulative[i] - t.cumulative[i - 1];
      const Eigen::Vector2d p = powers(0.5 * (t.d[i] + t.d[i - 1]));
      first += share * p;
      covariance += share * p * p.transpose();
    }
    covariance -= first * first.transpose();
    return first;
  };
  Eigen::Matrix2d covariance;
  Table table = make(lambda);
  Eigen::Vector2d miss = means - moments(table, covariance);
  for (int i = 0; i < 200; ++i) {
    if (miss.norm() < 1e-9) return table;
    const Eigen::Vector2d step = covariance.ldlt().solve(miss);
    double share = 1;
    for (int halvings = 0;; ++halvings) {
      const Eigen::Vector2d next = lambda + share * step;
      Eigen::Matrix2d next_covariance;
      Table trial = make(next);
      const Eigen::Vector2d next_miss = means - moments(trial, next_covariance);
      // Along the step the dual falls as long as what is missed still points along it.
      if (next_miss.allFinite() && next_miss.dot(step) > -0.5 * std::abs(miss.dot(step))) {
        lambda = next, covariance = next_covariance, miss = next_miss, table = std::move(trial);
        break;
      }
      if (halvings == 60) return std::nullopt;
      share *= 0.5;
    }
  }
  return miss.norm() < 1e-6 ? std::optional(table) : std::nullopt;
}

/// The fit to mean diameter and mean volume, both met by the finite sample itself.
std::optional<std::vector<double>> draw_fit(const SizeSpec& s, int dim, int n, double mean_of_power) {
  const Eigen::Vector2d wanted(1.0, mean_of_power / std::pow(s.mean, dim));
  Eigen::Vector2d aim = wanted, lambda = Eigen::Vector2d::Zero();
  for (int i = 0; i < 60; ++i) {
    const auto table = tilt(s, dim, aim, lambda);
    if (!table) return std::nullopt;
    std::vector<double> d = quantiles(*table, n, true);
    const Eigen::Vector2d got(mean_power(d, 1) / s.mean, mean_power(d, dim) / std::pow(s.mean, dim));
    if ((got - wanted).cwiseAbs().maxCoeff() < 1e-7) return d;
    aim += 0.8 * (wanted - got);
  }
  return std::nullopt;
}

/// Shares by largest remainder.
std::vector<double> draw_list(const SizeSpec& s, int n) {
  const std::size_t kinds = s.diameters.size();
  std::vector<double> weights = s.weights;
  weights.resize(kinds, 1.0);
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<int> counts(kinds);
  std::vector<std::pair<double, std::size_t>> remainder;
  int left = n;
  for (std::size_t i = 0; i < kinds; ++i) {
    const double share = n * weights[i] / total;
    counts[i] = static_cast<int>(share);
    left -= counts[i];
    remainder.emplace_back(counts[i] - share, i);
  }
  std::sort(remainder.begin(), remainder.end());
  for (int i = 0; i < left; ++i) ++counts[remainder[i % kinds].second];
  std::vector<double> d;
  for (std::size_t i = 0; i < kinds; ++i) d.insert(d.end(), counts[i], s.diameters[i]);
  return d;
}

std::vector<double> draw_shape(const PackSpec& spec, int n) {
  const SizeSpec& s = spec.sizes;
  if (s.type == SizeType::lognormal) return draw_lognormal(s, n);
  if (s.type == SizeType::list) return draw_list(s, n);
  if (s.type == SizeType::fit) return draw_power_law(s, n);
  std::vector<double> d(n);
  for (int i = 0; i < n; ++i) d[i] = n > 1 ? s.min + (s.max - s.min) * i / (n - 1.0) : 0.5 * (s.min + s.max);
  return d;
}

double total_volume(int dim, const std::vector<double>& d) {
  return grain_volume(dim, 1.0) * mean_power(d, dim) * static_cast<double>(d.size());
}

/// Repeats `draw(solid)` until the part inside the box is `inside`; the loss depends on the sizes drawn.
template <class Draw>
auto draw_for_inside(const PackSpec& spec, double inside, const Draw& draw) {
  auto d = draw(inside);
  for (int i = 0; i < 4 && d; ++i) {
    const double loss = expected_loss(spec, *d);
    if (loss == 0) break;
    d = draw(inside + loss);
  }
  return d;
}

std::string fit_error(const PackSpec& spec, double solid) {
  const SizeSpec& s = spec.sizes;
  const int dim = spec.dimension;
  const double unit = grain_volume(dim, 1.0), low = std::pow(s.mean, dim);
  const double high =
      std::pow(s.min, dim) + (s.mean - s.min) * (std::pow(s.max, dim) - std::pow(s.min, dim)) / (s.max - s.min);
  const double box = box_volume(spec);
  return fmt::format(
      "pack.count, pack.fraction and [sizes] contradict each other: {} grains at fraction {:.4g} need a mean {} of "
      "{:.4g}, but diameters from {:.4g} to {:.4g} with mean {:.4g} have between {:.4g} and {:.4g}: count {} would "
      "allow fractions from {:.4g} to {:.4g}; leave out count or fraction to have it derived",
      spec.count, spec.fraction, dim == 2 ? "grain area" : "grain volume", solid / spec.count, s.min, s.max, s.mean,
      unit * low, unit * high, spec.count, spec.count * unit * low / box, spec.count * unit * high / box);
}

/// Area or volume of the grains inside the box, as far as it is known before they are placed.
double expected_inside(const PackSpec& spec, const std::vector<double>& d) {
  return total_volume(spec.dimension, d) - expected_loss(spec, d);
}

/// The count that gives the fraction: first with the mean volume of the distribution, then with that of the sample,
/// which lacks some of a long tail.
int derive_count(const PackSpec& spec) {
  const double wanted = spec.fraction * box_volume(spec), most = 1e8;
  int count = static_cast<int>(std::lround(std::clamp(expected_count(spec), 1.0, most)));
  for (int i = 0; i < 4; ++i) {
    const double inside = expected_inside(spec, draw_shape(spec, count));
    count = static_cast<int>(std::lround(std::clamp(count * wanted / inside, 1.0, most)));
  }
  return count;
}

void check_sum(const PackSpec& spec, const std::vector<double>& d, std::vector<std::string>& errors) {
  const double box = box_volume(spec), inside = expected_inside(spec, d);
  const double margin = 0.005 * spec.fraction * box + 0.5 * inside / static_cast<double>(d.size());
  if (std::abs(inside - spec.fraction * box) <= margin) return;
  errors.push_back(fmt::format(
      "pack.count, pack.fraction and [sizes] contradict each other: {} grains of these sizes fill {:.4g} {}, a "
      "fraction "
      "of {:.4g} of the box, not {:.4g}; leave out count (it would be {}) or fraction, or set sizes.scale = true",
      spec.count, inside, spec.dimension == 2 ? "m^2" : "m^3", inside / box, spec.fraction, derive_count(spec)));
}

}  // namespace

double grain_volume(int dimension, double d) {
  return dimension == 2 ? std::numbers::pi / 4 * d * d : std::numbers::pi / 6 * d * d * d;
}

double box_volume(const PackSpec& spec) {
  double volume = 1;
  for (int k = 0; k < spec.dimension; ++k) volume *= spec.upper[k] - spec.lower[k];
  return volume;
}

double expected_loss(const PackSpec& spec, const std::vector<double>& diameters) {
  if (spec.walls == PackWalls::inside) return 0;
  double loss = 0;
  for (int k = 0; k < spec.dimension; ++k) {
    if (spec.periodic[k]) continue;
    for (double d : diameters) {
      // The integral over the centre's distance of the segment or cap cut off, at both walls.
      const double r = d / 2, cut = spec.dimension == 2 ? r * r * r * 2 / 3 : std::numbers::pi / 4 * r * r * r * r;
      loss += 2 * cut / (spec.upper[k] - spec.lower[k]);
    }
  }
  return loss;
}

double expected_count(const PackSpec& spec) {
  if (spec.count > 0) return spec.count;
  const double mean = expected_inside(spec, draw_shape(spec, nominal_count)) / nominal_count;
  return spec.fraction * box_volume(spec) / mean;
}

bool sizes_adapt(const PackSpec& spec) {
  return spec.fraction > 0 && (spec.sizes.type == SizeType::fit || spec.sizes.scale);
}

std::vector<double> draw_diameters(const PackSpec& given, std::optional<double> solid,
                                   std::vector<std::string>& errors) {
  PackSpec spec = given;
  const double inside = spec.fraction * box_volume(spec);
  const bool derived = spec.count == 0;
  if (derived) spec.count = derive_count(spec);
  std::optional<std::vector<double>> d;
  if (spec.sizes.type == SizeType::fit && spec.fraction > 0) {
    const auto draw = [&](double total) {
      return draw_fit(spec.sizes, spec.dimension, spec.count, total / (spec.count * grain_volume(spec.dimension, 1.0)));
    };
    d = solid ? draw(*solid) : draw_for_inside(spec, inside, draw);
    if (!d) errors.push_back(fit_error(spec, solid.value_or(inside)));
  } else {
    d = draw_shape(spec, spec.count);
    if (spec.sizes.scale) {
      const auto draw = [&, unit = *d](double total) {
        std::vector<double> scaled = unit;
        const double factor = std::pow(total / total_volume(spec.dimension, unit), 1.0 / spec.dimension);
        for (double& v : scaled) v *= factor;
        return std::optional(scaled);
      };
      d = solid ? draw(*solid) : draw_for_inside(spec, inside, draw);
    } else if (!derived && spec.fraction > 0) {
      check_sum(spec, *d, errors);
    }
  }
  if (d) std::sort(d->begin(), d->end(), std::greater<>());
  return d.value_or(std::vector<double>{});
}

}  // namespace cairn::pack_detail
