// Energy, forces and steps of the soft grains.

#include "pack_minimiser.hpp"

#include <algorithm>
#include <limits>

namespace cairn::pack_detail {

template <int Dim>
Minimiser<Dim>::Minimiser(Grains<Dim>& grains, double scale, double skin)
    : grains_(grains), scale_(scale), skin_(skin) {
  const int n = grains.count();
  for (int k = 0; k < Dim; ++k) v_[k].assign(n, 0.0), f_[k].assign(n, 0.0);
  // A large grain has as many contacts as its surface has room for: a mass in proportion keeps all periods alike.
  const double mean = sum_of(n, [&](int i) { return grains.radius[i]; }) / n;
  inverse_mass_.resize(n);
  for (int i = 0; i < n; ++i) inverse_mass_[i] = 1 / std::max(1.0, std::pow(grains.radius[i] / mean, Dim - 1));
  build_list();
}

template <int Dim>
void Minimiser<Dim>::build_list() {
  const int n = grains_.count();
  first_.clear();
  second_.clear();
  reach_.clear();
  LevelGrid<Dim> grid(grains_.box, grains_.radius);
  // The grid knows the radii before they are scaled.
  const double swell = std::max(0.0, scale_ - 1) * *std::max_element(grains_.radius.begin(), grains_.radius.end());
  std::array<double, Dim> at;
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < Dim; ++k) {
      // Centres drift across periodic boundaries while they move.
      const double turn = grains_.box.inverse_period[k];
      double& x = grains_.x[k][i];
      x -= grains_.box.length[k] * std::floor((x - grains_.box.lower[k]) * turn);
      at[k] = x;
    }
    const double r = scale_ * grains_.radius[i];
    grid.visit(at, r + skin_ + swell, grid.level_of(grains_.radius[i]), [&](int j) {
      double d2 = 0;
      for (int k = 0; k < Dim; ++k) {
        const double d = grains_.box.image(at[k] - grains_.x[k][j], k);
        d2 += d * d;
      }
      const double sum = r + scale_ * grains_.radius[j];
      if (d2 >= (sum + skin_) * (sum + skin_)) return;
      first_.push_back(i);
      second_.push_back(j);
      reach_.push_back(sum);
    });
    grid.insert(i, grains_.radius[i], at);
  }
  built_ = grains_.x;
}

template <int Dim>
bool Minimiser<Dim>::list_is_stale() const {
  const double most = 0.25 * skin_ * skin_;
  const double beyond = sum_of(grains_.count(), [&](int i) {
    double d2 = 0;
    for (int k = 0; k < Dim; ++k) d2 += (grains_.x[k][i] - built_[k][i]) * (grains_.x[k][i] - built_[k][i]);
    return d2 > most ? 1.0 : 0.0;
  });
  return beyond > 0;
}

/// Pairs in blocks: the first loop has no branches and no stores that could collide, so that it is vectorised.
template <int Dim>
void Minimiser<Dim>::add_forces() {
  constexpr int block = 256;
  alignas(64) double push[Dim][block];
  for (int k = 0; k < Dim; ++k) std::fill(f_[k].begin(), f_[k].end(), 0.0);
  const int pairs = static_cast<int>(first_.size());
  for (int start = 0; start < pairs; start += block) {
    const int m = std::min(block, pairs - start);
    const int *a = first_.data() + start, *b = second_.data() + start;
    const double* reach = reach_.data() + start;
    for (int p = 0; p < m; ++p) {
      double d[Dim], d2 = 1e-300;
      for (int k = 0; k < Dim; ++k) {
        d[k] = grains_.box.image(grains_.x[k].data()[a[p]] - grains_.x[k].data()[b[p]], k);
        d2 += d[k] * d[k];
      }
      const double pull = reach[p] / std::sqrt(d2) - 1;
      const double size = pull > 0 ? pull : 0.0;
      for (int k = 0; k < Dim; ++k) push[k][p] = size * d[k];
    }
    for (int k = 0; k < Dim; ++k) {
      double* f = f_[k].data();
      for (int p = 0; p < m; ++p) {
        f[a[p]] += push[k][p];
        f[b[p]] -= push[k][p];
      }
    }
  }
}

/// One step of FIRE; a centre that has reached the end of its room stops there and feels no force across it.
template <int Dim>
void Minimiser<Dim>::fire_step() {
  add_forces();
  const int n = grains_.count();
  double power = 0, vv = 0, ff = 0;
  for (int k = 0; k < Dim; ++k) {
    const double *x = grains_.x[k].data(), *low = grains_.low[k].data(), *high = grains_.high[k].data();
    double *f = f_[k].data(), *v = v_[k].data();
    for (int i = 0; i < n; ++i) {
      const bool stopped = (x[i] <= low[i] && f[i] < 0) || (x[i] >= high[i] && f[i] > 0);
      f[i] = stopped ? 0.0 : f[i];
    }
    power += sum_of(n, [&](int i) { return f[i] * v[i]; });
    for (int i = 0; i < n; ++i) f[i] *= inverse_mass_[i];
    vv += sum_of(n, [&](int i) { return v[i] * v[i]; });
    ff += sum_of(n, [&](int i) { return f[i] * f[i]; });
  }
  if (power > 0) {
    if (++downhill_ > 5) {
      dt_ = std::min(1.1 * dt_, 0.6);
      mixing_ *= 0.99;
    }
  } else {
    downhill_ = 0;
    dt_ = std::max(0.5 * dt_, 0.01);
    mixing_ = 0.1;
    for (Column& v : v_) std::fill(v.begin(), v.end(), 0.0);
    vv = 0;
  }
  move(mixing_, ff > 0 ? mixing_ * std::sqrt(vv / ff) : 0.0);
}

template <int Dim>
void Minimiser<Dim>::move(double mixing, double turn) {
  const double dt = dt_, keep = 1 - mixing, gain = turn + dt;
  for (int k = 0; k < Dim; ++k) {
    const double *f = f_[k].data(), *low = grains_.low[k].data(), *high = grains_.high[k].data();
    double *x = grains_.x[k].data(), *v = v_[k].data();
    for (int i = 0, n = grains_.count(); i < n; ++i) {
      const double speed = keep * v[i] + gain * f[i], to = x[i] + dt * speed;
      const double held = to < low[i] ? low[i] : to > high[i] ? high[i] : to;
      v[i] = held == to ? speed : 0.0;
      x[i] = held;
    }
  }
}

template <int Dim>
Overlap Minimiser<Dim>::check() const {
  Overlap all;
  const double shrink = scale_ > 1 ? 1 / scale_ : 1;
  for (std::size_t p = 0; p < first_.size(); ++p) {
    const int a = first_[p], b = second_[p];
    double d2 = 0;
    for (int k = 0; k < Dim; ++k) {
      const double d = grains_.box.image(grains_.x[k][a] - grains_.x[k][b], k);
      d2 += d * d;
    }
    if (d2 >= reach_[p] * reach_[p]) continue;
    const double d = std::sqrt(d2), smaller = std::min(grains_.radius[a], grains_.radius[b]);
    all.largest = std::max(all.largest, (reach_[p] * shrink - d) / (smaller * scale_ * shrink));
    all.energy += (reach_[p] - d) * (reach_[p] - d);
  }
  return all;
}

template <int Dim>
typename Minimiser<Dim>::End Minimiser<Dim>::run(double tolerance, int most, int& iterations, double& budget) {
  constexpr int between_checks = 20, patience = 300, overhead = 100;  // an iteration costs something without grains
  double before = std::numeric_limits<double>::max();
  for (int i = 0; i < most; ++i) {
    if (i % between_checks == 0) {
      const Overlap now = check();
      if (now.largest <= tolerance) return End::clear;
      if (budget <= 0) return End::spent;
      if (i % patience == 0) {
        if (now.energy > 0.95 * before) return End::stuck;
        before = now.energy;
      }
    }
    if (list_is_stale()) build_list();
    fire_step();
    ++iterations;
    budget -= grains_.count() + overhead;
  }
  return check().largest <= tolerance ? End::clear : End::spent;
}

template <int Dim>
double Minimiser<Dim>::energy() {
  return check().energy;
}

template <int Dim>
Column Minimiser<Dim>::squeeze() {
  build_list();
  Column sum(grains_.count(), 0.0);
  for (std::size_t p = 0; p < first_.size(); ++p) {
    const int a = first_[p], b = second_[p];
    double d2 = 0;
    for (int k = 0; k < Dim; ++k) {
      const double d = grains_.box.image(grains_.x[k][a] - grains_.x[k][b], k);
      d2 += d * d;
    }
    const double depth = std::max(0.0, reach_[p] - std::sqrt(d2));
    sum[a] += depth * depth;
    sum[b] += depth * depth;
  }
  return sum;
}

template class Minimiser<2>;
template class Minimiser<3>;

}  // namespace cairn::pack_detail
