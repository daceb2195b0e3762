#pragma once
/// What contact needs to know of materials, pairs of them and the faces of the domain.

#include "cairn/body/patch.hpp"
#include "cairn/contact/gap.hpp"

namespace cairn {

/// What contact needs to know of a material.
struct ContactMaterial {
  double longitudinal_modulus = 0;  // K + 4G/3 [Pa]
  double wave_speed = 0;            // of longitudinal waves at the start [m/s]; 0: it does not yield
};

/// Law and friction between two materials.
struct PairLaw {
  ContactLaw law = ContactLaw::friction;
  double friction = 0;
  /// Binds bodies in all directions, without touching or releasing.
  bool binds() const { return law == ContactLaw::none || law == ContactLaw::stick; }
};

/// What contact needs to know of a crack.
struct CrackContact {
  enum class Tie { none, normal, slip };
  bool meets = true;        // its faces keep each other out, or stick
  PairLaw law;              // between the faces
  bool all_bodies = true;   // cuts every body that is not rigid
  std::vector<int> bodies;  // else those that it cuts, ascending
  Tie tie = Tie::none;      // what its faces share besides: the velocity along the normal, or across it
  bool cuts_body(int body) const { return all_bodies || std::binary_search(bodies.begin(), bodies.end(), body); }
};

template <int Dim>
struct FaceCondition {
  FaceType type = FaceType::free;
  Vec<Dim> velocity = Vec<Dim>::Zero();  // of a fixed face or wall [m/s]
  std::vector<PairLaw> friction;         // of a wall, for each material
  Leaving leaving = Leaving::remove;     // of a free face
  bool moves = false;                    // a wall whose plane is not that of the domain's face, or will not be
  double plane = 0;                      // then its position along the normal [m]
};

/// All faces, two for each direction (lower, upper); empty types in periodic directions.
template <int Dim>
using FaceConditions = std::array<FaceCondition<Dim>, 2 * Dim>;

/// Whether a node lies on a face of the domain or beyond it; face = 2 x direction + side.
template <int Dim>
bool at_face(const Index<Dim>& place, int face, const Lattice<Dim>& lattice) {
  const int d = face / 2;
  return !lattice.periodic(d) && (face % 2 == 0 ? place[d] <= 0 : place[d] >= lattice.cells()[d]);
}

/// Cells from a node to the plane of a face, along its normal out of the domain; negative beyond it.
template <int Dim>
double cells_to_plane(const Index<Dim>& place, int face, const FaceCondition<Dim>& condition,
                      const Lattice<Dim>& lattice) {
  const int d = face / 2;
  if (!condition.moves) return face % 2 ? lattice.cells()[d] - place[d] : place[d];
  const double plane = lattice.scaled(d, condition.plane);
  return face % 2 ? plane - place[d] : place[d] - plane;
}

/// Cells in front of a moving wall within which it acts on nodes: it acts on those nearer to its plane than to the next
/// layer.
inline constexpr double wall_reach = 0.5;

/// Whether a wall acts on a node.
template <int Dim>
bool at_wall(const Index<Dim>& place, int face, const FaceConditions<Dim>& faces, const Lattice<Dim>& lattice) {
  if (faces[face].type != FaceType::wall) return false;
  return faces[face].moves ? cells_to_plane<Dim>(place, face, faces[face], lattice) <= wall_reach
                           : at_face<Dim>(place, face, lattice);
}

/// Share of a node in sums over a patch: 0 where another patch answers for it. On a symmetry plane sums hold both
/// halves; beyond it they are the image of those inside.
template <int Dim>
double node_share(PatchId patch, const Index<Dim>& place, const Lattice<Dim>& lattice,
                  const FaceConditions<Dim>& faces) {
  double share = lattice.owns_node(patch, place) ? 1.0 : 0.0;
  for (int face = 0; face < 2 * Dim; ++face)
    if (faces[face].type == FaceType::symmetry && at_face<Dim>(place, face, lattice))
      share *= place[face / 2] == 0 || place[face / 2] == lattice.cells()[face / 2] ? 0.5 : 0.0;
  return share;
}

/// Contact settings of a run.
template <int Dim>
struct ContactSettings {
  ContactOptions options;
  std::vector<ContactMaterial> materials;
  std::vector<PairLaw> pairs;  // materials x materials
  FaceConditions<Dim> faces{};
  std::vector<CrackContact> cracks;
  contact::TouchingGap gap, gap_at_wall;
  int bodies = 0;              // of the case: contacts with faces are numbered behind them
  bool keep_contacts = false;  // sum what passes between pairs, for output
  bool keep_tools = false;     // sum what bodies do to tools
  // Rigid bodies turn along chords (contact/course.hpp), not tangents. Chords strain what sticks to them by t^2/2 in
  // and out: for steps that take the strain at their start and at their end, as "both" does, so that the two cancel.
  bool chords = true;

  static ContactSettings make(const ContactOptions& options, std::vector<ContactMaterial> materials,
                              const FaceConditions<Dim>& faces);
  /// Volume that bodies around a node have [m^Dim]: a cell, less where walls and fixed faces, but for one of them, take
  /// a part.
  double room(const Index<Dim>& place, const Lattice<Dim>& lattice, int but_for = -1) const;
  /// The nearest node that is no further beyond a wall than the first layer on its plane or behind.
  Index<Dim> node_at_walls(Index<Dim> place, const Lattice<Dim>& lattice) const;
  /// A body's gradient of volume at a node in cells of size 1, from its NodeSums there; that of mass is divided by the
  /// density.
  Vec<Dim> gradient_share(const double* sums, const Lattice<Dim>& lattice, double room) const;
  /// Distance [cells] from a node to a body's near surface along the normal, from its NodeSums there (contact/gap.hpp).
  double distance(const double* sums, const Vec<Dim>& normal, const Lattice<Dim>& lattice, double room) const;
  const PairLaw& pair(int a, int b) const { return pairs[static_cast<std::size_t>(a) * materials.size() + b]; }
};

}  // namespace cairn
