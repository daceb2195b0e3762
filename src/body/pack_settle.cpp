// The search for a pack without overlaps: placing, growing, and moving the grains which do not fit.

#include <algorithm>
#include <numeric>
#include <type_traits>

#include "pack_minimiser.hpp"

namespace cairn::pack_detail {
namespace {

template <int Dim>
std::array<double, Dim> position(const Grains<Dim>& grains, int i) {
  std::array<double, Dim> at;
  for (int k = 0; k < Dim; ++k) at[k] = grains.x[k][i];
  return at;
}

template <int Dim>
LevelGrid<Dim> grid_of(const Grains<Dim>& grains) {
  LevelGrid<Dim> grid(grains.box, grains.radius);
  for (int i = 0; i < grains.count(); ++i) grid.insert(i, grains.radius[i], position(grains, i));
  return grid;
}

/// Distance from `at` to the nearest surface of a grain, at most `most`; below zero inside a grain.
template <int Dim>
double clearance(const Grains<Dim>& grains, const LevelGrid<Dim>& grid,
                 const std::type_identity_t<std::array<double, Dim>>& at, double scale, double most) {
  double least = most;
  grid.visit(at, most, grid.finest(), [&](int j) {
    double d2 = 0;
    for (int k = 0; k < Dim; ++k) {
      const double d = grains.box.image(at[k] - grains.x[k][j], k);
      d2 += d * d;
    }
    least = std::min(least, std::sqrt(d2) - scale * grains.radius[j]);
  });
  return least;
}

template <int Dim>
double mean_radius(const Grains<Dim>& grains) {
  return sum_of(grains.count(), [&](int i) { return grains.radius[i]; }) / grains.count();
}

template <int Dim>
double skin_of(const Grains<Dim>& grains) {
  return 0.25 * mean_radius(grains);
}

/// A random point of the room that the centre of grain `i` has.
template <int Dim>
std::array<double, Dim> random_point(const Grains<Dim>& grains, int i, Random& random) {
  std::array<double, Dim> at;
  for (int k = 0; k < Dim; ++k) {
    const bool periodic = grains.box.inverse_period[k] != 0;
    const double low = periodic ? grains.box.lower[k] : grains.low[k][i];
    const double high = periodic ? low + grains.box.length[k] : grains.high[k][i];
    at[k] = low + (high - low) * random();
  }
  return at;
}

/// Takes the most squeezed of the small grains out and puts them into the largest holes.
template <int Dim>
void relocate(Grains<Dim>& grains, const Column& squeeze, Random& random, double& budget) {
  const int n = grains.count(), moved = std::max(1, n / 400), samples = std::min(20 * n, 400000);
  const double mean = mean_radius(grains);
  std::vector<std::pair<double, int>> worst;
  for (int i = 0; i < n; ++i) {
    if (grains.radius[i] <= 1.05 * mean) worst.emplace_back(-squeeze[i] * (0.2 + random()), i);
  }
  std::sort(worst.begin(), worst.end());
  worst.resize(std::min<std::size_t>(worst.size(), moved));
  LevelGrid<Dim> grid = grid_of(grains);
  for (const auto& [_, i] : worst) grid.remove(i, grains.radius[i], position(grains, i));
  std::vector<std::pair<double, std::array<double, Dim>>> holes(samples);
  for (auto& [size, at] : holes) {
    at = random_point(grains, worst.front().second, random);
    size = -clearance(grains, grid, at, 1.0, mean);
  }
  std::sort(holes.begin(), holes.end());
  std::size_t next = 0;
  for (const auto& [_, i] : worst) {
    // Holes found later may have been filled by the grains moved before.
    std::array<double, Dim> at = holes[next].second;
    while (next + 1 < holes.size() && clearance(grains, grid, at, 1.0, mean) < -0.999 * holes[next].first) {
      at = holes[++next].second;
    }
    for (int k = 0; k < Dim; ++k) grains.x[k][i] = std::clamp(at[k], grains.low[k][i], grains.high[k][i]);
    grid.insert(i, grains.radius[i], position(grains, i));
  }
  budget -= 4.0 * samples;
}

}  // namespace

template <int Dim>
void sort_by_cell(Grains<Dim>& grains, std::vector<int>& identity) {
  const LevelGrid<Dim> grid(grains.box, grains.radius);
  const int n = grains.count();
  std::vector<std::pair<int, std::size_t>> key(n);
  for (int i = 0; i < n; ++i) {
    key[i].first = grid.level_of(grains.radius[i]);
    key[i].second = grid.cell_of(key[i].first, position(grains, i));
  }
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return key[a] < key[b]; });
  const auto permute = [&](auto& column) {
    auto copy = column;
    for (int i = 0; i < n; ++i) copy[i] = column[order[i]];
    column = copy;
  };
  for (int k = 0; k < Dim; ++k) {
    permute(grains.x[k]);
    permute(grains.low[k]);
    permute(grains.high[k]);
  }
  permute(grains.radius);
  permute(identity);
}

template <int Dim>
void place(Grains<Dim>& grains, std::vector<int>& identity, Random& random, int& iterations, double& budget) {
  constexpr int tries = 30;
  double volume = 1, solid = 0;
  for (double l : grains.box.length) volume *= l;
  for (double r : grains.radius) solid += grain_volume(Dim, 2 * r);
  const double loose = Dim == 2 ? 0.5 : 0.3;
  const double start = std::min(1.0, std::pow(loose * volume / solid, 1.0 / Dim));
  LevelGrid<Dim> grid(grains.box, grains.radius);
  for (int i = 0; i < grains.count(); ++i) {
    std::array<double, Dim> best{};
    double most = -1e300;
    const double r = start * grains.radius[i];
    for (int t = 0; t < tries && most < r; ++t) {
      const std::array<double, Dim> at = random_point(grains, i, random);
      const double room = clearance(grains, grid, at, start, 1.001 * r);
      if (room > most) {
        most = room;
        best = at;
      }
    }
    for (int k = 0; k < Dim; ++k) grains.x[k][i] = best[k];
    grid.insert(i, grains.radius[i], best);
  }
  sort_by_cell(grains, identity);
  for (double part : {0.0, 0.25, 0.5, 0.7, 0.8, 0.88, 0.94, 0.97, 0.99}) {
    Minimiser<Dim> minimiser(grains, start + part * (1 - start), skin_of(grains));
    minimiser.run(0.02, 1000, iterations, budget);
  }
}

template <int Dim>
bool settle(Grains<Dim>& grains, Random& random, double tolerance, int& iterations, double& budget) {
  using End = typename Minimiser<Dim>::End;
  const double scale = 1 + 0.1 * tolerance, aim = 0.95 * tolerance, skin = skin_of(grains);
  double best = 0;
  std::array<Column, Dim> kept;
  for (bool first = true;; first = false) {
    Minimiser<Dim> minimiser(grains, scale, skin);
    if (minimiser.run(aim, first ? 20000 : 2000, iterations, budget) == End::clear) return true;
    const double energy = minimiser.energy();
    if (first || energy < best) {
      best = energy;
      kept = grains.x;
    } else {
      grains.x = kept;
    }
    if (budget <= 0) {
      grains.x = kept;
      return false;
    }
    relocate(grains, Minimiser<Dim>(grains, scale, skin).squeeze(), random, budget);
  }
}

template void sort_by_cell<2>(Grains<2>&, std::vector<int>&);
template void sort_by_cell<3>(Grains<3>&, std::vector<int>&);
template bool settle<2>(Grains<2>&, Random&, double, int&, double&);
template bool settle<3>(Grains<3>&, Random&, double, int&, double&);
template void place<2>(Grains<2>&, std::vector<int>&, Random&, int&, double&);
template void place<3>(Grains<3>&, std::vector<int>&, Random&, int&, double&);

}  // namespace cairn::pack_detail
