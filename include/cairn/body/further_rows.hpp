#pragma once
/// Rows behind a piece's dense box of nodes: velocity fields of the sides of cracks.
///
/// A velocity field is (body, side set). That of the empty set is the dense box; behind it, in every array of nodes,
/// stand the rows of the others, few or none, ascending in (node, side set). Points whose nodes all have the empty set
/// know nothing of them. Others come in blocks of eight that work on a scratch copy of their rows, behind all others:
/// the kernels are the same (transfer/cut_blocks.hpp).

#include <algorithm>
#include <utility>

#include "cairn/body/crack_point.hpp"
#include "cairn/core/aligned.hpp"
#include "cairn/grid/box.hpp"

namespace cairn {

template <int Dim>
struct FurtherRow {
  Index<Dim> place;  // of the node
  SideSet sides;
  bool own = true;  // points of the piece touch it; else it came from neighbours

  /// The order of offsets in a box, then of sets.
  friend bool operator<(const FurtherRow& a, const FurtherRow& b) {
    for (int d = Dim - 1; d >= 0; --d)
      if (a.place[d] != b.place[d]) return a.place[d] < b.place[d];
    return a.sides < b.sides;
  }
  friend bool operator==(const FurtherRow& a, const FurtherRow& b) { return a.place == b.place && a.sides == b.sides; }
};

/// What rows know of the cracks in their set: for the n-th, sums over points of N V s and of N V n, with s = 1 where
/// the way to the node goes from above to below, -1 from below to above, and n the crack's normal there.
template <int Dim>
struct NodeCrossings {
  static constexpr int sign = 0, normal = 1, each = 1 + Dim, width = SideSet::most * each;
};

/// The sides that the nodes around a point see it on: places from `first` on, `extent` in each direction.
template <int Dim>
struct PointSides {
  static constexpr int extent = 5, size = Dim == 2 ? 25 : 125;  // whatever the shape function, and one to spare
  Index<Dim> first{};
  std::array<int, size> row;  // in FurtherRows::rows, -1 for the dense box

  PointSides() { row.fill(-1); }
  int at(const Index<Dim>& place) const {
    int o = 0;
    for (int d = Dim - 1; d >= 0; --d) {
      const int i = place[d] - first[d];
      if (i < 0 || i >= extent) return -1;
      o = o * extent + i;
    }
    return row[o];
  }
};

template <int Dim>
struct FurtherRows {
  std::vector<FurtherRow<Dim>> rows;    // ascending
  AlignedDoubles crossings;             // NodeCrossings of each
  std::vector<int> blocks;              // eights of points, by their first, of which one has nodes across cracks
  std::vector<PointSides<Dim>> points;  // lane_count for each of these blocks
  int scratch = 0;                      // rows behind all others that such a block works on

  void clear() { *this = {}; }
  /// Position of a row, -1 where there is none.
  int find(const Index<Dim>& place, SideSet sides) const {
    const FurtherRow<Dim> wanted{place, sides};
    const auto at = std::lower_bound(rows.begin(), rows.end(), wanted);
    return at != rows.end() && *at == wanted ? static_cast<int>(at - rows.begin()) : -1;
  }
  /// Positions [first, last) of a node's rows.
  std::pair<int, int> at(const Index<Dim>& place) const {
    if (rows.empty()) return {0, 0};
    const auto first = std::lower_bound(rows.begin(), rows.end(), FurtherRow<Dim>{place, {}});
    auto last = first;
    while (last != rows.end() && last->place == place) ++last;
    return {static_cast<int>(first - rows.begin()), static_cast<int>(last - rows.begin())};
  }
  std::size_t memory() const {
    return rows.capacity() * sizeof(rows[0]) + crossings.capacity() * sizeof(double) + blocks.capacity() * sizeof(int) +
           points.capacity() * sizeof(points[0]);
  }
};

}  // namespace cairn
