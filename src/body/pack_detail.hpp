#pragma once
/// Parts of the packing method that only its own sources see.

#include <cmath>
#include <optional>
#include <random>

#include "cairn/body/pack.hpp"

namespace cairn::pack_detail {

/// Uniform in [0, 1), the same on every system (the distributions of the standard library are not).
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double operator()() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }

 private:
  std::mt19937_64 engine_;
};

/// Area or volume of a grain of diameter `d`.
double grain_volume(int dimension, double d);

/// Area or volume of the box.
double box_volume(const PackSpec& spec);

/// Area or volume of the grains expected to reach out of the box when centres are spread evenly (walls = overlap).
double expected_loss(const PackSpec& spec, const std::vector<double>& diameters);

/// The diameters [m], largest first. `solid` is the total area or volume of the grains wanted, for sizes which adapt
/// (fit and scale); empty: from the spec. What is wrong is added to `errors`; the result is then of no use.
std::vector<double> draw_diameters(const PackSpec& spec, std::optional<double> solid, std::vector<std::string>& errors);

/// About how many grains there will be, without a limit.
double expected_count(const PackSpec& spec);

/// True where sizes adapt to the fraction.
bool sizes_adapt(const PackSpec& spec);

using Column = std::vector<double>;

template <int Dim>
struct Box {
  std::array<double, Dim> lower, length;
  std::array<double, Dim> inverse_period;  // 1 / length; 0 where not periodic

  /// Shortest difference between periodic images.
  double image(double d, int k) const { return d - length[k] * std::rint(d * inverse_period[k]); }
};

/// Grains in columns, coarse levels of the grid first.
template <int Dim>
struct Grains {
  Box<Dim> box;
  std::array<Column, Dim> x;          // centres
  std::array<Column, Dim> low, high;  // where centres may be; infinite where periodic
  Column radius;
  int count() const { return static_cast<int>(radius.size()); }
};

/// Sum of f(i) in eight partial sums, which the compiler may keep in one vector.
template <class F>
double sum_of(int n, const F& f) {
  double part[8] = {};
  int i = 0;
  for (; i + 8 <= n; i += 8) {
    for (int l = 0; l < 8; ++l) part[l] += f(i + l);
  }
  double sum = 0;
  for (; i < n; ++i) sum += f(i);
  for (double p : part) sum += p;
  return sum;
}

/// Cells in levels: grains share a level when their diameters lie within a factor of two, so that a wide range of sizes
/// costs no more than a narrow one.
template <int Dim>
class LevelGrid {
 public:
  LevelGrid(const Box<Dim>& box, const Column& radius);
  int level_of(double radius) const;
  std::size_t cell_of(int level, const std::array<double, Dim>& x) const;
  void insert(int grain, double radius, const std::array<double, Dim>& x);
  void remove(int grain, double radius, const std::array<double, Dim>& x);

  /// Calls `f(j)` for the grains of level `finest` and coarser that may be nearer to `x` than `reach` plus their
  /// radius.
  template <class F>
  void visit(const std::array<double, Dim>& x, double reach, int finest, const F& f) const {
    for (int l = 0; l <= finest; ++l) {
      if (!levels_[l].head.empty()) visit_level(levels_[l], x, reach, f);
    }
  }
  int finest() const { return static_cast<int>(levels_.size()) - 1; }

 private:
  struct Level {
    std::array<int, Dim> cells;
    std::array<double, Dim> inverse_size;
    double largest;         // radius
    std::vector<int> head;  // first grain of each cell; empty where the level has no grains
  };
  template <class F>
  void visit_level(const Level& level, const std::array<double, Dim>& x, double reach, const F& f) const;

  Box<Dim> box_;
  double largest_;
  std::vector<Level> levels_;
  std::vector<int> next_;  // of each grain
};

template <int Dim>
template <class F>
void LevelGrid<Dim>::visit_level(const Level& level, const std::array<double, Dim>& x, double reach, const F& f) const {
  std::array<int, 3> first{}, last{}, cells{1, 1, 1};
  for (int k = 0; k < Dim; ++k) {
    const double at = x[k] - box_.lower[k], far = reach + level.largest;
    const int n = level.cells[k];
    cells[k] = n;
    first[k] = static_cast<int>(std::floor((at - far) * level.inverse_size[k]));
    last[k] = static_cast<int>(std::floor((at + far) * level.inverse_size[k]));
    if (box_.inverse_period[k] == 0) {
      first[k] = std::min(std::max(first[k], 0), n - 1);
      last[k] = std::max(std::min(last[k], n - 1), 0);
    } else if (last[k] - first[k] >= n) {
      first[k] = 0;
      last[k] = n - 1;
    }
  }
  const auto wrap = [](int c, int n) { return c < 0 ? c + n : c >= n ? c - n : c; };
  for (int c = first[2]; c <= last[2]; ++c) {
    for (int b = first[1]; b <= last[1]; ++b) {
      const std::size_t row = static_cast<std::size_t>(wrap(c, cells[2])) * cells[1] + wrap(b, cells[1]);
      for (int a = first[0]; a <= last[0]; ++a) {
        for (int j = level.head[row * cells[0] + wrap(a, cells[0])]; j >= 0; j = next_[j]) f(j);
      }
    }
  }
}

struct Overlap {
  double largest = 0;  // of a pair, of its smaller radius
  double energy = 0;   // sum of the squares of the relative overlaps
};

/// Overlaps of the grains as they stand, without reference to any list.
template <int Dim>
Overlap measure_overlap(const Grains<Dim>& grains);

/// Puts the grains, and `identity` with them, into the order in which they are worked on: levels of size, coarse first,
/// then cells, so that neighbours lie close in memory.
template <int Dim>
void sort_by_cell(Grains<Dim>& grains, std::vector<int>& identity);

/// Moves the centres until no overlap exceeds `tolerance` of the smaller radius. Returns whether it came to that.
/// `iterations` is added to; `budget` bounds the work, in grains times iterations, and is drawn down.
template <int Dim>
bool settle(Grains<Dim>& grains, Random& random, double tolerance, int& iterations, double& budget);

/// Places the grains, which come largest first, at random and grows them to full size; sorts them by cell.
template <int Dim>
void place(Grains<Dim>& grains, std::vector<int>& identity, Random& random, int& iterations, double& budget);

}  // namespace cairn::pack_detail
