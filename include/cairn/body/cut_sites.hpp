#pragma once
/// Material points whose volumes follow the surface of a round body (docs/surfaces.md).

#include <vector>

#include "cairn/body/shape.hpp"
#include "cairn/grid/box.hpp"

namespace cairn {

/// A material point at the start: its position [m], and its volume over that of a whole point; 0: no point.
struct PointSite {
  double share = 0;
  Vec3 position = Vec3::Zero();
};

/// True for shapes without flat faces, or that do not know of them: balls, ellipsoids, what comes from files, and
/// compounds of these.
bool is_round(const Shape& shape);

/// Whether the surface of a shape is cut where that is asked for, with `per_direction` points along the smallest side
/// of a cell [m]: what is thinner than two points would lose them.
inline bool can_be_cut(const Shape& shape, double smallest_cell, int per_direction) {
  return is_round(shape) && smallest_width(shape) * per_direction >= 2 * smallest_cell;
}

/// The points of a shape on a lattice of sites, each the room of one whole point. A site of which at least half lies
/// inside the shape holds a point; what lies inside any other goes, in equal parts, to those of its 2 Dim neighbours
/// that hold one, or else of all its 3^Dim - 1. Volume and first moment of the shape are kept, to the accuracy of the
/// samples taken of a site that is cut (8 along each side in 2D, 4 in 3D). Points stay in their sites.
template <int Dim>
class CutSites {
 public:
  /// \param origin   of the lattice: the lower corner of site 0, in the coordinates of the shape [m]
  /// \param spacing  of the sites [m]
  /// \param sites    those that will be asked for; what is found at a site does not depend on which these are
  CutSites(const Shape& shape, const Vec3& origin, const Vec3& spacing, const Box<Dim>& sites);

  /// The point at a site, in the coordinates of the shape.
  PointSite at(const Index<Dim>& site) const;

 private:
  /// The place in a site at `within` of its sides (0 to 1).
  template <class F>
  Vec3 place(const Index<Dim>& site, F&& within) const {
    Vec3 x = Vec3::Zero();
    for (int d = 0; d < Dim; ++d) x[d] = origin_[d] + (site[d] + within(d)) * spacing_[d];
    return x;
  }
  PointSite measured(const Shape& shape, const Index<Dim>& site) const;
  bool holds_point(const Index<Dim>& site) const { return measured_[box_.offset(site)].share >= 0.5; }
  /// Those neighbours of a site to which it gives what it holds.
  std::vector<Index<Dim>> receivers(const Index<Dim>& site) const;

  Vec3 origin_, spacing_;
  Box<Dim> box_;  // the sites and two more all round
  std::vector<PointSite> measured_;
};

}  // namespace cairn
