// Cells in levels of size, and the check of overlaps that uses nothing else.

#include <algorithm>
#include <numeric>

#include "pack_detail.hpp"

namespace cairn::pack_detail {

template <int Dim>
LevelGrid<Dim>::LevelGrid(const Box<Dim>& box, const Column& radius)
    : box_(box), largest_(*std::max_element(radius.begin(), radius.end())), next_(radius.size(), -1) {
  const double smallest = *std::min_element(radius.begin(), radius.end());
  const int count = std::min(24, 1 + static_cast<int>(std::floor(std::log2(largest_ / smallest))));
  levels_.resize(count);
  const int most = static_cast<int>(std::pow(4.0 * static_cast<double>(radius.size()) + 64, 1.0 / Dim)) + 1;
  for (int l = 0; l < count; ++l) {
    Level& level = levels_[l];
    level.largest = std::ldexp(largest_, -l);
    for (int k = 0; k < Dim; ++k) {
      level.cells[k] = std::clamp(static_cast<int>(std::min(1e9, box.length[k] / (2 * level.largest))), 1, most);
      level.inverse_size[k] = level.cells[k] / box.length[k];
    }
  }
}

template <int Dim>
int LevelGrid<Dim>::level_of(double radius) const {
  const int l = static_cast<int>(std::floor(std::log2(largest_ / radius)));
  return std::clamp(l, 0, finest());
}

template <int Dim>
std::size_t LevelGrid<Dim>::cell_of(int l, const std::array<double, Dim>& x) const {
  const Level& level = levels_[l];
  std::size_t cell = 0;
  for (int k = Dim - 1; k >= 0; --k) {
    const int c = static_cast<int>(std::floor((x[k] - box_.lower[k]) * level.inverse_size[k]));
    cell = cell * level.cells[k] + std::clamp(c, 0, level.cells[k] - 1);
  }
  return cell;
}

template <int Dim>
void LevelGrid<Dim>::insert(int grain, double radius, const std::array<double, Dim>& x) {
  const int l = level_of(radius);
  Level& level = levels_[l];
  if (level.head.empty()) {  // most levels of a wide range of sizes stay without grains
    std::size_t cells = 1;
    for (int n : level.cells) cells *= static_cast<std::size_t>(n);
    level.head.assign(cells, -1);
  }
  int& head = level.head[cell_of(l, x)];
  next_[grain] = head;
  head = grain;
}

template <int Dim>
void LevelGrid<Dim>::remove(int grain, double radius, const std::array<double, Dim>& x) {
  const int l = level_of(radius);
  int* link = &levels_[l].head[cell_of(l, x)];
  while (*link != grain) link = &next_[*link];
  *link = next_[grain];
}

template <int Dim>
Overlap measure_overlap(const Grains<Dim>& grains) {
  LevelGrid<Dim> grid(grains.box, grains.radius);
  std::vector<int> order(grains.count());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return grains.radius[a] > grains.radius[b]; });
  Overlap overlap;
  for (int i : order) {
    std::array<double, Dim> at;
    for (int k = 0; k < Dim; ++k) at[k] = grains.x[k][i];
    const double r = grains.radius[i];
    grid.visit(at, r, grid.level_of(r), [&](int j) {
      double d2 = 0;
      for (int k = 0; k < Dim; ++k) {
        const double d = grains.box.image(at[k] - grains.x[k][j], k);
        d2 += d * d;
      }
      const double depth = (r + grains.radius[j] - std::sqrt(d2)) / std::min(r, grains.radius[j]);
      if (depth <= 0) return;
      overlap.largest = std::max(overlap.largest, depth);
      overlap.energy += depth * depth;
    });
    grid.insert(i, r, at);
  }
  return overlap;
}

template class LevelGrid<2>;
template class LevelGrid<3>;
template Overlap measure_overlap<2>(const Grains<2>&);
template Overlap measure_overlap<3>(const Grains<3>&);

}  // namespace cairn::pack_detail
