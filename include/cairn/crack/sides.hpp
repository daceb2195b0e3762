#pragma once
/// The sides of cracks on which nodes lie, as the points around them see it: which velocity fields there are.

#include <span>

#include "cairn/body/patch.hpp"

namespace cairn {

/// What every rank knows of a crack.
struct Crack {
  std::array<int, 2> ends = {0, 0};             // indices of its first and last point
  std::array<bool, 2> open = {true, true};      // the first and last end: at or beyond a body's surface, or joined
  std::array<bool, 2> joined = {false, false};  // to another crack that it ran into
  std::array<double, 2> grown = {0, 0};         // lengths by which the ends grew [m]
  std::array<double, 2> since = {-1, -1};       // when steady growth began [s]; -1: not yet
  bool all_bodies = true;                       // cuts every body that is not rigid
  std::vector<int> bodies;                      // else those that it cuts
  static constexpr int state_size = 10;         // what changes in a run
  void state_of(double* to) const {
    for (const int e : {0, 1}) *to++ = ends[e], *to++ = open[e], *to++ = joined[e], *to++ = grown[e], *to++ = since[e];
  }
  void restore(const double* from) {
    for (const int e : {0, 1}) {
      ends[e] = static_cast<int>(*from++), open[e] = *from++ != 0, joined[e] = *from++ != 0;
      grown[e] = *from++, since[e] = *from++;
    }
  }
  bool is_tip(int index) const { return (index == ends[0] && !open[0]) || (index == ends[1] && !open[1]); }
  std::vector<int> spared;  // bodies that it parted and does not cut any more
  bool idle = false;        // it cuts no body any more
  bool cuts(int body) const {
    return (all_bodies || std::ranges::find(bodies, body) != bodies.end()) &&
           std::ranges::find(spared, body) == spared.end();
  }
};

/// Whether a crack ends at a point, inside a body.
template <int Dim>
bool is_tip(const Crack& crack, const CrackPoint<Dim>& point) {
  if constexpr (Dim == 3)
    return point.tip;
  else
    return crack.is_tip(point.index);
}

/// The segments of cracks within reach of a patch, in 3D triangles, by the cells they can matter to.
template <int Dim>
class CrackSegments {
 public:
  struct Segment {
    int crack;
    std::array<Vec<Dim>, Dim> corners;
    Vec<Dim> normal;  // from below to above
    double distance_to(const Vec<Dim>& x) const;
  };
  /// Of a crack point in 3D: the mean of its triangles', weighted by their areas.
  struct PointNormal {
    std::int32_t crack;
    Image image;
    std::int32_t index;
    Vec<Dim> normal;
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
  /// How far along the line from x to y it meets a segment of another crack, or one of its own that is not among the
  /// last `skipped` before x; as a share of the line, infinite where it meets none.
  double first_meeting(const Vec<Dim>& x, const Vec<Dim>& y, int crack, double skipped) const;
  /// The crack's unit normal at one of its points; zero where it has no segment here.
  Vec<Dim> normal_at(const CrackPoint<Dim>& point) const;

 private:
  Vec<Dim> normal_near(int c, const Vec<Dim>& x) const;

  std::vector<Segment> segments_;     // ascending in (crack, place along it)
  std::vector<PointNormal> normals_;  // ascending in (crack, image, index); 3D
  Box<Dim> cells_;
  std::vector<int> first_, listed_;  // for each cell, where its segments begin in `listed_`
};

/// Lists what further rows a piece has, and which of its points use them, after its nodes have been laid out and before
/// they are projected. Returns how many of the rows see more cracks than a set holds.
template <int Dim>
int find_sides(Piece<Dim>& piece, const CrackSegments<Dim>& segments, const std::vector<Crack>& cracks,
               const Lattice<Dim>& lattice);

}  // namespace cairn
