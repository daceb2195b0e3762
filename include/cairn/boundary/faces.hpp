#pragma once
/// Faces of the domain: fixed faces and symmetry planes as conditions on nodal velocities, walls as contact with a
/// rigid half-space. Nodes beyond a face follow it: a fixed face's velocity holds there too, a wall acts as on the
/// wall, and beyond a symmetry plane lies the mirror image. To add a kind of face: FaceType, its name in the case
/// reader, and here.

#include "cairn/contact/sweep.hpp"

namespace cairn {

template <int Dim>
struct FaceCondition {
  FaceType type = FaceType::free;
  Vec<Dim> velocity = Vec<Dim>::Zero();  // of a fixed face or wall [m/s]
  std::vector<PairLaw> friction;         // of a wall, for each material
};

/// All faces, two for each direction (lower, upper); empty types in periodic directions.
template <int Dim>
using FaceConditions = std::array<FaceCondition<Dim>, 2 * Dim>;

/// Adds the mirror image across symmetry planes to nodal sums, forces and extras: even quantities double on the plane,
/// the normal's components vanish there.
template <int Dim>
void mirror_sums(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces);
/// The same for forces alone, or for momenta projected again.
template <int Dim>
void mirror_vectors(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                    AlignedDoubles NodeBox<Dim>::*vectors);

/// Fixed faces: their velocity at the nodes, for strains. With `close_ledger`, on velocities projected again at the end
/// of the step, the loss of bringing the points to that velocity goes into the ledger (contact/ledger.hpp).
template <int Dim>
void constrain_velocity(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                        const std::vector<Body>& bodies, bool close_ledger);
/// Fixed faces, after the momentum update: velocity, and the acceleration that leads to it (Nairn 2013, section 2.4);
/// the work goes into the ledger, and with `close_ledger` (nothing is projected again) the loss as well.
template <int Dim>
void constrain_motion(Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
                      const std::vector<Body>& bodies, double dt, bool close_ledger);

/// Contact with walls in one patch, in the same passes as contact between bodies and after it.
template <int Dim>
class WallContact {
 public:
  /// Finds the nodes on walls from complete sums.
  void find(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const FaceConditions<Dim>& faces,
            const ContactSettings<Dim>& settings, const std::vector<Body>& bodies);
  void first_pass(Patch<Dim>& patch, const FaceConditions<Dim>& faces, const ContactSettings<Dim>& settings, double dt);
  void second_pass(Patch<Dim>& patch, const FaceConditions<Dim>& faces, const ContactSettings<Dim>& settings, double dt,
                   bool last);
  void repeat_pass(Patch<Dim>& patch, const FaceConditions<Dim>& faces, const ContactSettings<Dim>& settings,
                   double dt);

 private:
  struct Entry {
    int piece, node, face;
    int on_wall;  // entry of the node on the wall whose decision this one follows; itself there
    double mass;
    bool open, owned;
    contact::Decision decision;
    PairLaw law;
    contact::NodeRecord<Dim> record;
  };
  void keep_ledger(const Entry& entry, Patch<Dim>& patch, const FaceConditions<Dim>& faces, double given) const;
  Vec<Dim> impulse(const Entry& entry, const Vec<Dim>& momentum, const FaceConditions<Dim>& faces,
                   const ContactSettings<Dim>& settings, bool second) const;
  std::vector<Entry> entries_;
};

}  // namespace cairn
