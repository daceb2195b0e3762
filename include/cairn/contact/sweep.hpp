#pragma once
/// Contact of the bodies in one patch: one sweep finds the nodes that bodies share, then each pass visits those alone.
/// No neighbour search, no iteration, work linear in the nodes touched (Bardenhagen, Brackbill & Sulsky 2000, section
/// 3).
///
/// With common normals a node has one partner body, the rigid one or else the heaviest; every other body meets the rest
/// of the node and the partner takes the opposite of their impulses, so that the impulses sum to zero for any number of
/// bodies. With own normals each body meets the rest of the node along its own normal, as the papers print it.

#include "cairn/body/patch.hpp"
#include "cairn/contact/course.hpp"
#include "cairn/contact/gap.hpp"
#include "cairn/contact/laws.hpp"
#include "cairn/contact/ledger.hpp"

namespace cairn {

/// What contact needs to know of a material.
struct ContactMaterial {
  double longitudinal_modulus = 0;  // K + 4G/3 [Pa]
};

/// Law and friction between two materials.
struct PairLaw {
  ContactLaw law = ContactLaw::friction;
  double friction = 0;
};

/// Contact settings of a run.
template <int Dim>
struct ContactSettings {
  ContactOptions options;
  std::vector<ContactMaterial> materials;
  std::vector<PairLaw> pairs;  // materials x materials, then one row for walls
  std::array<FaceType, 6> faces{};
  bool keep_contacts = false;  // sum what passes between pairs, for output
  // Rigid bodies turn along chords (contact/course.hpp), not tangents. Chords strain what sticks to them by t^2/2 in
  // and out: for steps that take the strain at their start and at their end, as "both" does, so that the two cancel.
  bool chords = true;

  static ContactSettings make(const ContactOptions& options, std::vector<ContactMaterial> materials,
                              const std::array<FaceType, 6>& faces);
  /// Distance [cells] from a node to a body's near surface, from its NodeSums there (contact/gap.hpp). \param room
  /// [m^Dim] that bodies around the node have: a cell, less where walls take a part.
  double distance(const double* sums, const Lattice<Dim>& lattice, double room) const;
  const PairLaw& pair(int a, int b) const { return pairs[static_cast<std::size_t>(a) * materials.size() + b]; }
};

/// One body at a node shared by several.
template <int Dim>
struct ContactEntry {
  int piece = 0, node = 0;  // position in the patch's pieces, offset in the piece's box
  double mass = 0;
  bool rigid = false;
  int turning = -1;   // a rigid body that turns: its position in ContactSweep::turning_
  bool open = false;  // contact is possible (not: too little there, too far apart, no normal)
  contact::Decision decision;
  bool compressive = false, stress_free = false;
  PairLaw law;
  Vec<Dim> normal = Vec<Dim>::Zero();  // out of the body
  contact::NodeRecord<Dim> record;
};

template <int Dim>
class ContactSweep {
 public:
  /// Finds the shared nodes of the patch from complete sums, with normals, partners and gates. Replaces what was there.
  void find(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings,
            const std::vector<Body>& bodies);

  /// Before the momentum update: changes the momenta in the sums; decides by reaction.
  void first_pass(Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings, double dt);
  /// After p += dt f: changes the forces, so that points and nodes agree. With `last`, no repeat pass follows in this
  /// step, and the ledger is closed here.
  void second_pass(Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings, double dt,
                   bool last);
  /// On momenta projected again (NodeBox::velocity, before division by mass); closes the ledger.
  void repeat_pass(Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings, double dt);

 private:
  struct SharedNode {
    int first, count, partner;  // entries; position of the partner among them
    Index<Dim> place;
    double share;  // in the ledger: 0 where another patch answers for it, half on a symmetry plane
  };
  enum class Pass { first, second, repeat };

  void count_bodies(const Patch<Dim>& patch);
  void list_entries(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings,
                    const std::vector<Body>& bodies);
  void prepare(SharedNode& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
               const ContactSettings<Dim>& settings, const std::vector<Body>& bodies);
  void set_gaps(const SharedNode& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                const ContactSettings<Dim>& settings, double room);
  void set_normals(const SharedNode& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice, NormalChoice choice);
  void set_gates(const SharedNode& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                 const ContactSettings<Dim>& settings, const std::vector<Body>& bodies);
  Vec<Dim> impulse(ContactEntry<Dim>& entry, const Vec<Dim>& P, const Vec<Dim>& F, const ContactSettings<Dim>& settings,
                   double dt, Pass pass) const;
  /// Impulses on all bodies of a node, from the momenta and forces in momenta_ and forces_; result in impulses_.
  void resolve(const SharedNode& node, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings, double dt,
               Pass pass);
  void load_node(const SharedNode& node, const Patch<Dim>& patch, Pass pass, double dt);
  void keep_pairs(const SharedNode& node, Patch<Dim>& patch, const Lattice<Dim>& lattice) const;
  void keep_ledger(const SharedNode& node, Patch<Dim>& patch, double dt, bool projected_again) const;

  Box<Dim> box_;
  std::vector<std::int32_t> bodies_at_;  // bodies at each node of the patch; later the node's place in shared_
  std::vector<SharedNode> shared_;
  std::vector<ContactEntry<Dim>> entries_;
  std::vector<Body> turning_;                          // the rigid bodies among them that turn
  std::vector<Vec<Dim>> momenta_, forces_, impulses_;  // of the node in hand
  std::vector<double> distances_;                      // likewise: from the node to the bodies' surfaces [cells]
};

}  // namespace cairn
