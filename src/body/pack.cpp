#include "cairn/body/pack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "cairn/core/error.hpp"
#include "cairn/core/memory.hpp"
#include "pack_detail.hpp"

namespace cairn {
namespace {

using namespace pack_detail;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double most_grains = 1e8;
constexpr double shortest = 1e-30, longest = 1e30;  // [m]: their volumes are numbers with room to spare

void check_numbers(const PackSpec& spec, std::vector<std::string>& errors) {
  if (spec.dimension != 2 && spec.dimension != 3) {
    errors.push_back(fmt::format("pack.dimension = {}: must be 2 or 3", spec.dimension));
    return;
  }
  for (int k = 0; k < spec.dimension; ++k) {
    if (!(spec.upper[k] > spec.lower[k]) || !std::isfinite(spec.upper[k] - spec.lower[k])) {
      errors.push_back(fmt::format("pack.lower, pack.upper: the box has no extent along {}, from {:.4g} to {:.4g}",
                                   "xyz"[k], spec.lower[k], spec.upper[k]));
    } else if (const double length = spec.upper[k] - spec.lower[k]; length < shortest || length > longest) {
      errors.push_back(fmt::format("pack.lower, pack.upper: the box is {:.4g} m long along {}; must be from {} to {}",
                                   length, "xyz"[k], shortest, longest));
    }
  }
  if (spec.count < 0 || spec.count > most_grains) {
    errors.push_back(fmt::format("pack.count = {}: must be from 1 to 1e8, or left out", spec.count));
  }
  if (!(spec.fraction >= 0 && spec.fraction < 1)) {
    errors.push_back(fmt::format("pack.fraction = {}: must be above 0 and below 1, or left out", spec.fraction));
  }
  if (spec.count == 0 && spec.fraction == 0) {
    errors.push_back("pack.count, pack.fraction: one of them is needed; the other may be left out");
  }
  if (!(spec.max_overlap > 0 && spec.max_overlap < 0.1)) {
    errors.push_back(fmt::format("pack.max_overlap = {}: must be above 0 and below 0.1", spec.max_overlap));
  }
  if (!(spec.effort > 0)) errors.push_back(fmt::format("pack.effort = {}: must be above 0", spec.effort));
}

void check_range(const SizeSpec& s, bool needs_room, std::vector<std::string>& errors) {
  if (!(s.min > 0 && std::isfinite(s.max) && (needs_room ? s.max > s.min : s.max >= s.min))) {
    errors.push_back(fmt::format("sizes.min = {}, sizes.max = {}: diameters must be above 0 and max {} min", s.min,
                                 s.max, needs_room ? "above" : "at least"));
  }
}

void check_mean(const SizeSpec& s, std::vector<std::string>& errors) {
  const double low = s.min, high = s.max > 0 ? s.max : infinity;
  if (!(s.mean > low && s.mean < high)) {
    errors.push_back(fmt::format("sizes.mean = {}: must lie between min = {} and max = {}", s.mean, low, high));
  }
}

void check_sizes(const PackSpec& spec, std::vector<std::string>& errors) {
  const SizeSpec& s = spec.sizes;
  if (s.scale && (spec.count == 0 || spec.fraction == 0)) {
    errors.push_back("sizes.scale = true: needs both pack.count and pack.fraction");
  }
  switch (s.type) {
    case SizeType::uniform:
      return check_range(s, false, errors);
    case SizeType::lognormal:
      if (s.min > 0 && s.max > 0) check_range(s, true, errors);
      if (!(s.sigma > 0 && s.sigma < 3)) {
        errors.push_back(fmt::format("sizes.sigma = {}: must be above 0 and below 3", s.sigma));
      }
      return check_mean(s, errors);
    case SizeType::fit:
      check_range(s, true, errors);
      if (s.scale)
        errors.push_back("sizes.scale = true: not with type \"fit\", whose diameters are fixed by min and max");
      return check_mean(s, errors);
    case SizeType::list:
      if (s.diameters.empty()) errors.push_back("sizes.diameters: at least one is needed");
      if (!s.weights.empty() && s.weights.size() != s.diameters.size()) {
        errors.push_back(
            fmt::format("sizes.weights: {} values for {} diameters", s.weights.size(), s.diameters.size()));
      }
      const auto bad = [](double v) { return !(v > 0 && std::isfinite(v)); };
      if (std::any_of(s.diameters.begin(), s.diameters.end(), bad)) {
        errors.push_back("sizes.diameters: must all be above 0");
      }
      const auto negative = [](double v) { return !(v >= 0 && std::isfinite(v)); };
      if (std::any_of(s.weights.begin(), s.weights.end(), negative) ||
          (!s.weights.empty() && std::none_of(s.weights.begin(), s.weights.end(), [](double v) { return v > 0; }))) {
        errors.push_back("sizes.weights: must not be below 0, and one at least above 0");
      }
  }
}

/// Diameters are numbers of a size that can be reckoned with.
void check_lengths(const SizeSpec& s, std::vector<std::string>& errors) {
  const auto check = [&](const char* key, double d) {
    if (d == 0 || (d >= shortest && d <= longest)) return;  // 0: not given
    errors.push_back(fmt::format("{} = {:.4g}: must be from {} to {}", key, d, shortest, longest));
  };
  check("sizes.min", s.min), check("sizes.max", s.max), check("sizes.mean", s.mean);
  if (!s.diameters.empty()) {
    check("sizes.diameters", *std::ranges::min_element(s.diameters));
    check("sizes.diameters", *std::ranges::max_element(s.diameters));
  }
}

/// Refuses more grains than there is memory for, before any of them is made.
void check_memory(const PackSpec& spec, std::vector<std::string>& errors) {
  constexpr double grain_bytes = 600;  // columns, neighbours and cells
  const double count = expected_count(spec), memory = std::min(available_memory(), memory_limit());
  const std::string key = spec.count > 0 ? "pack.count" : "pack.fraction, [sizes]";
  if (!(count <= most_grains)) {
    errors.push_back(fmt::format("{}: about {:.3g} grains; there may be {:.3g}", key, count, most_grains));
  } else if (count * grain_bytes > memory) {
    errors.push_back(fmt::format("{}: about {:.3g} grains need {:.3g} GB of memory, there are {:.3g} GB", key, count,
                                 1e-9 * count * grain_bytes, 1e-9 * memory));
  }
}

void check_room(const PackSpec& spec, const std::vector<double>& diameters, std::vector<std::string>& errors) {
  for (int k = 0; k < spec.dimension; ++k) {
    const double length = spec.upper[k] - spec.lower[k], least = (spec.periodic[k] ? 2 : 1) * diameters.front();
    if (length > least) continue;
    errors.push_back(
        fmt::format("pack.lower, pack.upper: the box is {:.4g} long along {}, but the largest grain ({:.4g}) "
                    "needs more than {:.4g}{}",
                    length, "xyz"[k], diameters.front(), least, spec.periodic[k] ? " in a periodic direction" : ""));
  }
  double solid = 0;
  for (double d : diameters) solid += grain_volume(spec.dimension, d);
  if (solid >= box_volume(spec)) {
    errors.push_back(
        fmt::format("pack.count, [sizes]: the grains fill {:.4g}, the box has only {:.4g}", solid, box_volume(spec)));
  }
}

template <int Dim>
class Packing {
 public:
  Packing(const PackSpec& spec, std::vector<double> diameters)
      : spec_(spec), random_(spec.seed), diameters_(std::move(diameters)), identity_(diameters_.size()) {
    std::iota(identity_.begin(), identity_.end(), 0);
    for (int k = 0; k < Dim; ++k) {
      grains_.box.lower[k] = spec.lower[k];
      grains_.box.length[k] = spec.upper[k] - spec.lower[k];
      grains_.box.inverse_period[k] = spec.periodic[k] ? 1 / grains_.box.length[k] : 0;
      for (auto* limit : {&inset_low_, &inset_high_}) {
        (*limit)[k].resize(diameters_.size());
        for (double& v : (*limit)[k]) v = spec.walls == PackWalls::inside ? 1 : random_();
      }
    }
  }

  Pack make();

 private:
  void set_sizes();
  bool refit(double fraction);
  double fraction_inside() const;
  [[noreturn]] void fail(const Overlap& left) const;
  Pack deliver() const;

  const PackSpec& spec_;
  Random random_;
  std::vector<double> diameters_;  // largest first
  std::vector<int> identity_;      // which of the diameters each grain has
  // How close to a wall a centre may come, in radii. Where grains may overlap the wall each has its own share: with one
  // limit for all, half grains would line up along the wall.
  std::array<std::vector<double>, Dim> inset_low_, inset_high_;
  Grains<Dim> grains_;
  Pack pack_;
};

template <int Dim>
void Packing<Dim>::set_sizes() {
  const int n = static_cast<int>(diameters_.size());
  grains_.radius.resize(n);
  for (int i = 0; i < n; ++i) grains_.radius[i] = diameters_[identity_[i]] / 2;
  for (int k = 0; k < Dim; ++k) {
    grains_.x[k].resize(n);
    grains_.low[k] = Column(n, -infinity);
    grains_.high[k] = Column(n, infinity);
    if (spec_.periodic[k]) continue;
    for (int i = 0; i < n; ++i) {
      grains_.low[k][i] = spec_.lower[k] + inset_low_[k][identity_[i]] * grains_.radius[i];
      grains_.high[k][i] = spec_.upper[k] - inset_high_[k][identity_[i]] * grains_.radius[i];
    }
  }
}

template <int Dim>
double Packing<Dim>::fraction_inside() const {
  double sum = 0;
  for (int i = 0; i < grains_.count(); ++i) {
    Vec3 at = Vec3::Zero();
    for (int k = 0; k < Dim; ++k) at[k] = grains_.x[k][i];
    sum += volume_inside(Dim, at, grains_.radius[i], spec_.lower, spec_.upper, spec_.periodic);
  }
  return sum / box_volume(spec_);
}

/// Where grains reach across walls, the part lost is known only once they are placed: sizes that adapt make up for it.
template <int Dim>
bool Packing<Dim>::refit(double fraction) {
  if (!sizes_adapt(spec_) || spec_.walls == PackWalls::inside) return false;
  if (std::abs(fraction - spec_.fraction) < 5e-4 * spec_.fraction) return false;
  double solid = 0;
  for (double d : diameters_) solid += grain_volume(Dim, d);
  std::vector<std::string> errors;
  auto next = draw_diameters(spec_, solid + (spec_.fraction - fraction) * box_volume(spec_), errors);
  if (!errors.empty()) return false;
  diameters_ = std::move(next);
  set_sizes();
  sort_by_cell(grains_, identity_);
  return true;
}

template <int Dim>
void Packing<Dim>::fail(const Overlap& left) const {
  // Grains smaller by about the overlaps that are left would have fitted; jammed grains have Dim contacts each.
  const double typical = std::min(0.3, std::sqrt(left.energy / (Dim * static_cast<double>(diameters_.size()))));
  const double lower = std::floor(100 * (pack_.fraction * std::pow(1 - typical, Dim) - 0.005)) / 100;
  throw RunError(fmt::format(
      "pack: not reached: {} grains at fraction {:.4f} still overlap by {:.2g} of the smaller radius, {:.2g} is "
      "allowed, "
      "after {} iterations; ask for a lower fraction (try {:.2f}), a wider range of sizes, another seed, more "
      "pack.effort or a larger pack.max_overlap",
      diameters_.size(), pack_.fraction, left.largest, spec_.max_overlap, pack_.iterations, lower));
}

template <int Dim>
Pack Packing<Dim>::make() {
  const double n = static_cast<double>(diameters_.size());
  double budget =
      spec_.effort * std::max(3e8, 4e4 * n);  // grains times iterations: seconds for a few hundred, minutes for 1e5
  set_sizes();
  place(grains_, identity_, random_, pack_.iterations, budget);
  constexpr int most_refits = 6;
  for (int i = 0;; ++i) {
    const bool clear = settle(grains_, random_, spec_.max_overlap, pack_.iterations, budget);
    const Overlap left = measure_overlap(grains_);
    pack_.fraction = fraction_inside();
    pack_.max_overlap = left.largest;
    if (!clear || left.largest > spec_.max_overlap) fail(left);
    if (i == most_refits || !refit(pack_.fraction)) return deliver();
  }
}

template <int Dim>
Pack Packing<Dim>::deliver() const {
  Pack pack = pack_;
  const int n = grains_.count();
  pack.centre.assign(n, Vec3::Zero());
  pack.radius.resize(n);
  for (int i = 0; i < n; ++i) {
    const int to = identity_[i];
    pack.radius[to] = grains_.radius[i];
    pack.mean_diameter += 2 * grains_.radius[i] / n;
    for (int k = 0; k < Dim; ++k) {
      double x = grains_.x[k][i];
      if (spec_.periodic[k]) {
        const double length = grains_.box.length[k];
        x -= length * std::floor((x - spec_.lower[k]) / length);
        if (x >= spec_.upper[k]) x = spec_.lower[k];
      }
      pack.centre[to][k] = x;
    }
  }
  return pack;
}

}  // namespace

std::vector<std::string> check_pack(const PackSpec& spec) {
  std::vector<std::string> errors;
  check_numbers(spec, errors);
  check_sizes(spec, errors);
  check_lengths(spec.sizes, errors);
  if (errors.empty()) check_memory(spec, errors);
  if (!errors.empty()) return errors;
  const std::vector<double> diameters = draw_diameters(spec, {}, errors);
  if (errors.empty()) check_room(spec, diameters, errors);
  return errors;
}

Pack pack_grains(const PackSpec& spec) {
  if (auto errors = check_pack(spec); !errors.empty()) throw InputError(std::move(errors));
  std::vector<std::string> errors;
  std::vector<double> diameters = draw_diameters(spec, {}, errors);
  return spec.dimension == 2 ? Packing<2>(spec, std::move(diameters)).make()
                             : Packing<3>(spec, std::move(diameters)).make();
}

}  // namespace cairn
