#pragma once
/// Explicit cracks as patches hold them: crack points, the corners of a polyline in 2D and of triangles in 3D (Nairn
/// 2013; Guo & Nairn, CMES 16, 2006; docs/cracks.md).

#include <array>
#include <cstdint>
#include <tuple>

#include "cairn/body/points.hpp"

namespace cairn {

/// The history of the law between a crack's faces at a point (crack/traction.hpp).
struct Bond {
  enum State : std::int32_t { none, holds, broken };
  State state = none;
  double length = 0;                    // of the crack that the point stands for [m]; in 3D its area [m2]
  std::array<double, 2> peak = {0, 0};  // largest opening and slip so far [m]
  double dissipated = 0;                // where it is broken [J/m2]
};

/// What an edge of a crack's triangle is: between two of them, or of its rim, at or beyond a body's surface or inside.
enum class CrackEdge : std::int32_t { inner, open, tip };

/// A triangle of a crack, held by one of its corners. Seen from above its corners go round to the left.
struct CrackTriangle {
  std::int32_t second = 0, third = 0;  // indices of the other corners
  std::int32_t edges = 0;              // two bits for each: from the first corner, from the second, from the third

  CrackEdge edge(int k) const { return CrackEdge{edges >> 2 * k & 3}; }
  void set_edge(int k, CrackEdge kind) { edges |= static_cast<std::int32_t>(kind) << 2 * k; }
};

/// What crack points know of those around them, beside the next one along the line: in 3D triangles.
template <int Dim>
struct CrackHeld {};
template <>
struct CrackHeld<3> {
  static constexpr int most = 6;  // a point holds two on average, as triangles go to those corners that hold the fewest
  std::array<CrackTriangle, most> triangles{};
  std::int32_t held = 0;
  bool tip = false;  // an edge of the rim inside a body ends here
};

/// A point of a crack. The plane lies between the two faces, which begin in one place and move with the material on
/// their sides. Upper is left of the crack's direction, that of ascending index; in 3D where triangles turn to the
/// left.
template <int Dim>
struct CrackPoint : CrackHeld<Dim> {
  static constexpr std::int32_t index_step = 1024;  // between neighbours at the start: room for those that come between

  std::int32_t crack = 0, index = 0;  // index along the crack, kept for life
  std::int32_t next = 0;              // index of the point that follows; its own at the last one, and in 3D
  bool own = true;                    // of the patch that holds it; else a copy of a neighbour's
  bool filled = true;                 // material lay beside it in the last step
  int faces_filled = 3;               // and beside which face: 1 below, 2 above
  Image image{};                      // crossings of periodic boundaries since the start
  Vec<Dim> plane = Vec<Dim>::Zero();  // [m]
  Vec<Dim> lower = Vec<Dim>::Zero();  // face below [m]
  Vec<Dim> upper = Vec<Dim>::Zero();  // face above [m]
  Vec<Dim> lower_velocity = Vec<Dim>::Zero(), upper_velocity = Vec<Dim>::Zero();  // in the last step [m/s]

  Bond bond;                             // what its faces do to each other
  Vec<Dim> traction = Vec<Dim>::Zero();  // on the lower face, that on the upper is its opposite [Pa]

  static constexpr int filled_bit(int side) { return side > 0 ? 2 : 1; }
  Vec<Dim> opening() const { return upper - lower; }                         // [m]
  const Vec<Dim>& face(int side) const { return side > 0 ? upper : lower; }  // 1 above, -1 below
  Vec<Dim>& velocity(int side) { return side > 0 ? upper_velocity : lower_velocity; }
  /// Goes with the faces' velocities.
  void move(double dt) {
    lower += dt * lower_velocity, upper += dt * upper_velocity;
    plane = 0.5 * (lower + upper);
  }
  void shift(const Vec<Dim>& by) { plane += by, lower += by, upper += by; }
  /// The order in patches: images of one crack across periodic boundaries are lines of their own.
  friend bool operator<(const CrackPoint& a, const CrackPoint& b) {
    return std::tie(a.crack, a.image, a.index) < std::tie(b.crack, b.image, b.index);
  }
  /// Whether b comes next on the same line.
  bool precedes(const CrackPoint& b) const {
    return crack == b.crack && image == b.image && next == b.index && index != next;
  }
};

/// The cracks that the straight line from a point to a node crosses, at most three, as one number that orders them.
/// With a body it names a velocity field; empty, that of the points on the node's own side of all cracks.
class SideSet {
 public:
  static constexpr int most = 3;

  SideSet() = default;
  explicit SideSet(std::int64_t key) : key_(key) {}
  /// The set with one more crack, larger than those in it. Not for more than `most`.
  SideSet with(int crack) const {
    return SideSet(key_ | static_cast<std::int64_t>(crack + 1) << bits * (most - 1 - size()));
  }
  std::int64_t key() const { return key_; }
  bool empty() const { return key_ == 0; }
  int size() const {
    int n = 0;
    while (n < most && crack(n) >= 0) ++n;
    return n;
  }
  /// The n-th crack of the set, ascending; -1 where there is none.
  int crack(int n) const { return static_cast<int>(key_ >> bits * (most - 1 - n) & mask) - 1; }
  bool contains(int c) const { return crack(0) == c || crack(1) == c || crack(2) == c; }
  /// The set of those cracks for which keep(crack).
  template <class F>
  SideSet only(F&& keep) const {
    SideSet s;
    for (int n = 0; n < most; ++n)
      if (crack(n) >= 0 && keep(crack(n))) s = s.with(crack(n));
    return s;
  }
  SideSet without(int c) const {
    return only([&](int other) { return other != c; });
  }
  friend bool operator==(const SideSet&, const SideSet&) = default;
  friend auto operator<=>(const SideSet&, const SideSet&) = default;

  static constexpr int bits = 21;
  static constexpr std::int64_t mask = (std::int64_t{1} << bits) - 1;
  static constexpr int most_cracks = static_cast<int>(mask) - 1;

 private:
  std::int64_t key_ = 0;
};

}  // namespace cairn
