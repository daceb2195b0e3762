#pragma once
/// The sides of cracks on which nodes lie, as the points around them see it: which velocity fields there are. 2D.

#include <span>

#include "cairn/body/patch.hpp"

namespace cairn {

/// What every rank knows of a crack.
struct Crack {
  std::array<int, 2> ends = {0, 0};         // indices of its first and last point
  std::array<bool, 2> open = {true, true};  // the first and last end: at or beyond a body's surface
  bool all_bodies = true;                   // cuts every body that is not rigid
  std::vector<int> bodies;                  // else those that it cuts, ascending
  bool cuts(int body) const { return all_bodies || std::binary_search(bodies.begin(), bodies.end(), body); }
};

/// The segments of cracks within reach of a patch, by the cells they can matter to.
template <int Dim>
class CrackSegments {
 public:
  struct Segment {
    int crack;
    Vec<Dim> a, b;
    Vec<Dim> normal;  // from below to above
  };
  /// What the line from a point to a node crosses.
  struct Crossings {
    SideSet sides;
    std::array<double, NodeCrossings<Dim>::width> sums{};  // sign and normal for each crack of the set
    bool crowded = false;                                  // there are more cracks than a set holds
  };

  CrackSegments() = default;
  CrackSegments(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const std::vector<Crack>& cracks);

  bool empty() const { return segments_.empty(); }
  const std::vector<Segment>& all() const { return segments_; }
  /// Segments near a place, by number, ascending; none for places far from the patch.
  std::span<const int> near(const Vec<Dim>& x, const Lattice<Dim>& lattice) const;
  /// What the line from x, a point of the body, to a node crosses, of the segments listed.
  Crossings crossed(std::span<const int> near, const Vec<Dim>& x, const Vec<Dim>& node, int body,
                    const std::vector<Crack>& cracks) const;
  /// The unit normal of crack c nearest to x; zero where it has no segment here.
  Vec<Dim> normal_near(int c, const Vec<Dim>& x) const;

 private:
  std::vector<Segment> segments_;  // ascending in (crack, place along it)
  Box<Dim> cells_;
  std::vector<int> first_, listed_;  // for each cell, where its segments begin in `listed_`
};

/// Lists what further rows a piece has, and which of its points use them, after its nodes have been laid out and before
/// they are projected. Returns how many of the rows see more cracks than a set holds.
template <int Dim>
int find_sides(Piece<Dim>& piece, const CrackSegments<Dim>& segments, const std::vector<Crack>& cracks,
               const Lattice<Dim>& lattice);

}  // namespace cairn
