#pragma once
/// Faces of the domain as conditions on nodal velocities: fixed faces and symmetry planes. Nodes beyond a face follow
/// it: a fixed face's velocity holds there too, and beyond a symmetry plane lies the mirror image. Walls are contact
/// (contact/sweep.hpp). To add a kind of face: FaceType, its name in the case reader, and here.

#include "cairn/contact/settings.hpp"

namespace cairn {

/// Adds the mirror image across symmetry planes to nodal sums, forces and extras: even quantities double on the plane,
/// the normal's components vanish there.
template <int Dim>
void mirror_sums(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces);
/// The same for forces alone, or for momenta projected again.
template <int Dim>
void mirror_vectors(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                    AlignedDoubles NodeBox<Dim>::*vectors);

/// The same for NodeStress, in the place of the sums.
template <int Dim>
void mirror_stress(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces);

/// Fixed faces: their velocity at the nodes, for strains. With `close_ledger`, on velocities projected again at the end
/// of the step, the loss of bringing the points to that velocity goes into the ledger (contact/ledger.hpp).
template <int Dim>
void constrain_velocity(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                        const std::vector<Body>& bodies, bool close_ledger);
/// Fixed faces, after the momentum update: velocity, and the acceleration that leads to it (Nairn 2013, section 2.4);
/// the work goes into the ledger, with `close_ledger` (nothing is projected again) the loss as well, and with
/// `keep_tools` what the faces take into the patch's tools.
template <int Dim>
void constrain_motion(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                      const std::vector<Body>& bodies, double dt, bool close_ledger, bool keep_tools = false);

}  // namespace cairn
