#pragma once
/// Contact in one patch, between bodies and with walls: one sweep finds the nodes where something may touch, then each
/// pass visits those alone. No neighbour search, work linear in the nodes touched (Bardenhagen, Brackbill & Sulsky
/// 2000, section 3).
///
/// A node holds pairs. Every body at it forms one with the partner (the rigid body there, or else the heaviest), and
/// one with each wall on which or beyond which the node lies: a rigid partner with a known normal. What holds is
/// brought to rest with the least change of kinetic energy, all pairs at once; impulses of a pair are equal and
/// opposite. Where cracks cut bodies, a node's entries are their velocity fields: bodies meet in fields on the same
/// side of the cracks, and fields of one body meet across a crack (src/contact/sided_nodes.cpp).

#include "cairn/contact/course.hpp"
#include "cairn/contact/laws.hpp"
#include "cairn/contact/ledger.hpp"
#include "cairn/contact/settings.hpp"

namespace cairn {

/// One body at a node of contact, or one of its velocity fields there.
template <int Dim>
struct ContactEntry {
  int piece = 0, node = 0;  // position in the patch's pieces, row among the piece's nodes
  SideSet sides;
  int whole = -1;  // of a field among several: sums of its whole body, in ContactSweep::wholes_
  int material = 0;
  double mass = 0;
  bool rigid = false;
  int turning = -1;  // a rigid body that turns or gathers speed: its position in ContactSweep::turning_
  int tool = -1;     // that a rigid body belongs to
  contact::NodeRecord<Dim> record;
};

/// Two that may touch at a node.
template <int Dim>
struct NodePair {
  static constexpr int none = -1;
  int a = 0, b = none;  // entries, counted from the node's first; b is none for walls (and for all with own normals)
  int face = none;      // of a wall
  int crack = none;     // across a crack, from below to above
  CrackContact::Tie tie = CrackContact::Tie::none;  // binds in that direction alone
  PairLaw law;
  Vec<Dim> normal = Vec<Dim>::Zero();  // out of a
  bool open = false;                   // contact is possible (not: too little mass there, no normal, a fixed face)
  double gap = 0;                      // [cells]; across a crack [m]
  double yield = 0;                    // what a unit of force adds to the gap that counts as touching [cells/N]
  int gap_node = 0;                    // at a wall: offset of the node on it, which answers for those beyond
  bool compressive = false, stress_free = false;
  contact::Decision decision;
  Vec<Dim> impulse = Vec<Dim>::Zero();  // on a, in the pass under way
  Vec<Dim> second = Vec<Dim>::Zero();   // on a, of the pass whose impulses reach the points
};

template <int Dim>
class ContactSweep {
 public:
  /// Finds the nodes of the patch where something may touch, from complete sums, with pairs, normals and gates.
  /// Replaces what was there.
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

  /// Calls f(place, crack, force) for the forces [N] that contact put on the upper sides of cracks in the last second
  /// pass, at the nodes that the patch answers for.
  template <class F>
  void for_forces_across(double dt, F&& f) const {
    for (const Node& node : nodes_)
      for (int p = node.first_pair; node.share > 0 && p < node.first_pair + node.pair_count; ++p)
        if (pairs_[p].crack != NodePair<Dim>::none)
          f(node.place, pairs_[p].crack, Vec<Dim>(-node.share / dt * pairs_[p].second));
  }

 private:
  struct Node {
    int first, count;            // entries
    int first_pair, pair_count;  // pairs
    int partner;                 // position of the partner among the entries
    Index<Dim> place;
    double share;  // in the ledger: 0 where another patch answers for it, half on a symmetry plane
  };
  enum class Pass { first, second, repeat };
  /// How a pair acts while a node is solved.
  enum class Mode { off, slide, stick, bound };

  // find_contacts.cpp
  void count_bodies(const Patch<Dim>& patch);
  void list_nodes(const Patch<Dim>& patch, const Lattice<Dim>& lattice, const ContactSettings<Dim>& settings);
  void list_entries(const Patch<Dim>& patch, const ContactSettings<Dim>& settings, const std::vector<Body>& bodies);
  void list_pairs(Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                  const ContactSettings<Dim>& settings);
  void add_wall_pairs(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                      const ContactSettings<Dim>& settings);
  void set_normals(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                   const ContactSettings<Dim>& settings);
  void set_gaps(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                const ContactSettings<Dim>& settings);
  void set_gates(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                 const ContactSettings<Dim>& settings);

  const double* sums_of(const ContactEntry<Dim>& entry, const Patch<Dim>& patch) const;

  // sided_nodes.cpp
  bool has_sides(const Node& node) const;
  bool crosses_cracks(const Node& node) const;
  void solve_for_least();
  void sum_wholes(const Node& node, const Patch<Dim>& patch);
  void list_sided_pairs(Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                        const ContactSettings<Dim>& settings, bool fixed);
  bool on_one_side(const ContactEntry<Dim>& a, const ContactEntry<Dim>& b, const Patch<Dim>& patch,
                   const ContactSettings<Dim>& settings) const;
  void bind_far_fields(const Node& node, const ContactSettings<Dim>& settings);
  void add_crack_pairs(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
                       const ContactSettings<Dim>& settings);
  const double* crossing(const ContactEntry<Dim>& entry, int crack, const Patch<Dim>& patch) const;
  Vec<Dim> crack_normal(const Node& node, int crack, const Patch<Dim>& patch) const;

  // solve_node.cpp: the impulses of all pairs of a node, from momenta_ and forces_; their sums on the bodies in
  // impulses_
  void solve(const Node& node, const Patch<Dim>& patch, const Lattice<Dim>& lattice,
             const ContactSettings<Dim>& settings, double dt, Pass pass);
  void decide(const Node& node, const Patch<Dim>& patch, const ContactSettings<Dim>& settings, double dt);
  contact::Decision decide_across(const NodePair<Dim>& pair, const Vec<Dim>& P, const Vec<Dim>& F, double mass,
                                  double dt) const;
  void solve_pair(const Node& node, NodePair<Dim>& pair, Pass pass);
  void solve_together(const Node& node, Pass pass);
  void bring_to_rest(const Node& node);
  bool release_pairs(const Node& node);
  void add_friction(const Node& node);
  std::vector<Vec<Dim>> bound_directions(const NodePair<Dim>& pair) const;
  void solve_as_published(const Node& node, const ContactSettings<Dim>& settings, double dt, Pass pass);
  void give(const NodePair<Dim>& pair, const Vec<Dim>& impulse);
  void take_back(const Node& node, double dt);
  double given(const Node& node, double dt, bool again) const;
  double driven(const Node& node) const;
  double inverse_mass(const Node& node, int entry) const;
  double reduced_mass(const Node& node, const NodePair<Dim>& pair) const;
  Vec<Dim> relative_velocity(const Node& node, const NodePair<Dim>& pair) const;
  Vec<Dim> relative_acceleration(const Node& node, const NodePair<Dim>& pair) const;

  // sweep.cpp
  void load_node(const Node& node, const Patch<Dim>& patch, Pass pass, double dt);
  void keep_contacts(const Node& node, Patch<Dim>& patch, const Lattice<Dim>& lattice,
                     const ContactSettings<Dim>& settings, double dt) const;
  void keep_tools(const Node& node, Patch<Dim>& patch, const Lattice<Dim>& lattice) const;
  void keep_ledger(const Node& node, Patch<Dim>& patch, double dt, bool projected_again) const;

  Box<Dim> box_;
  std::vector<std::int32_t> bodies_at_;  // bodies at each node of the box; later the node's place in nodes_
  std::vector<Node> nodes_;
  std::vector<ContactEntry<Dim>> entries_;
  std::vector<NodePair<Dim>> pairs_;
  std::vector<std::array<double, NodeSums<Dim>::width>> wholes_;
  std::vector<Body> turning_;  // the rigid bodies among them that turn or gather speed
  std::array<Vec<Dim>, 2 * Dim> wall_velocities_;
  // Of the node in hand:
  std::vector<Vec<Dim>> momenta_, forces_, impulses_;
  std::vector<Mode> modes_;
  struct Row {
    int pair;
    Vec<Dim> along;
  };
  std::vector<Row> rows_;
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd right_;
};

}  // namespace cairn
