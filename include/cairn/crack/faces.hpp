#pragma once
/// How cracks move with the material: their faces see the rows on their side.

#include <functional>

#include "cairn/core/options.hpp"
#include "cairn/crack/sides.hpp"

namespace cairn {

/// The rows that a face of a crack sees, with weights that sum to 1 (moving least squares): they reproduce linear
/// fields and leave out light nodes smoothly. The same weights give the face its velocity and the rows its force, so
/// that momentum, angular momentum and power balance.
template <int Dim>
struct FaceRows {
  struct At {
    Index<Dim> place;
    SideSet sides;
    double weight;
  };
  std::vector<At> rows;
  double filled = 0;  // share of the nodes' weights that lies on nodes with material
  bool is_filled() const { return filled >= 0.5; }
};

/// A body's material at nodes, as its faces need it.
template <int Dim>
struct CrackSurroundings {
  const Patch<Dim>& patch;
  const Lattice<Dim>& lattice;
  const CrackSegments<Dim>& segments;
  const std::vector<Crack>& cracks;
  const std::vector<double>& densities;  // of bodies; 0 for rigid ones, which no crack cuts [kg/m3]
  StressUpdate update = StressUpdate::both;
};

/// \param side  1 above, -1 below
template <int Dim>
FaceRows<Dim> rows_of_face(const CrackSurroundings<Dim>& around, const CrackPoint<Dim>& point, int side);

/// Share of a full body at x: 1 inside of the cut bodies, 1/2 at their surface.
template <int Dim>
double fill_at(const CrackSurroundings<Dim>& around, int crack, const Vec<Dim>& x);

/// Velocity of a face that lies among a patch's nodes while its crack point is a neighbour's.
template <int Dim>
struct FaceMotion {
  std::int32_t point;  // position in the patch's list
  int side;            // 1 above, -1 below
  Vec<Dim> velocity;   // [m/s]
};

/// Gives the patch's own crack points the velocities of their faces, from those that strains see in the step: forces do
/// their work by them. With those that move the material instead, nodes' accelerations that no point sees would move
/// the faces against their tractions, and make energy. Of wide cracks a face may lie with a neighbour: returns what
/// this patch knows of faces of others' points.
template <int Dim>
std::vector<FaceMotion<Dim>> find_face_velocities(std::vector<CrackPoint<Dim>>& points,
                                                  const CrackSurroundings<Dim>& around);

/// A force on the material of one row at a node, by a face of a crack point.
template <int Dim>
struct RowForce {
  PatchId from;               // that found it
  std::int32_t crack, index;  // of the crack point
  int side;
  Index<Dim> place;
  SideSet sides;
  Vec<Dim> force;  // [N]
};

/// The tractions of the crack points whose faces lie among the patch's nodes, as forces on rows; with complete masses
/// and the momenta that strains see at the start of the step. Tractions are those of the opening `ahead` [s] later,
/// where strains see the stress as well: so that the faces' motion and the forces are a leapfrog. \param traction  of a
/// crack point with some opening, on its lower face [Pa]
template <int Dim>
std::vector<RowForce<Dim>> find_row_forces(
    const CrackSurroundings<Dim>& around, double ahead,
    const std::function<Vec<Dim>(const CrackPoint<Dim>&, const Vec<Dim>&)>& traction);

/// Puts forces in the order in which they are added. Of a face that several patches tell of, the first counts.
template <int Dim>
void sort_row_forces(std::vector<RowForce<Dim>>& forces);

/// Adds those on the patch's nodes to the complete forces there; of several bodies each takes its share by mass.
template <int Dim>
void add_row_forces(Patch<Dim>& patch, const CrackSurroundings<Dim>& around, const std::vector<RowForce<Dim>>& forces);

/// Own crack points that no material lies beside go with the nearest along the crack that it does.
template <int Dim>
void borrow_face_velocities(std::vector<CrackPoint<Dim>>& points);

/// Where a face has no material, nothing takes the traction of a law that holds: the faces of such points do not part,
/// or the law would store energy that nothing gave.
template <int Dim>
void keep_idle_bonds_closed(std::vector<CrackPoint<Dim>>& points);

}  // namespace cairn
