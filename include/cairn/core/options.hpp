#pragma once
/// Choices of method, as enums after parsing. Names are those of the case file.

#include <string>
#include <vector>

namespace cairn {

enum class ShapeFunction { linear, gimp, bspline2, cpdi };
enum class StressUpdate { last, first, both, modified_last };
enum class ContactLaw { none, stick, frictionless, friction };
enum class Release { approach, traction, reaction };
/// What decides how far apart bodies touch: the pressure between them, or a stand-off (ContactOptions::fill).
enum class GapRule { pressure, fill };
enum class NormalSource { density, mass_gradient, volume_gradient };
enum class NormalChoice { common, own };
enum class Gate { node, body };
enum class DepartingFriction { none, coulomb, printed };
enum class Passes { both, before, after };
/// What holds across the plane of a 2D case: no strain, or no stress.
enum class Plane { strain, stress };
/// What points move with, where momentum is projected again: the mean of the nodes' velocity after the momentum update
/// and of that projected again, or the latter, which is what F integrates.
enum class Motion { centred, projected };
/// Volumes of points at the surface of round bodies: all the same, or what of the body they stand for.
enum class Surface { whole, cut };
/// How much of the points' motion that no node sees is taken away (src/solver/noise_filter.cpp).
enum class NoiseFilter { off, weak, strong, xpic };
enum class FaceType { free, fixed, symmetry, wall, periodic };
/// What becomes of points that pass a free face.
enum class Leaving { remove, stop };
/// What becomes of points that are nowhere, turned inside out or no numbers.
enum class LostPoints { stop, drop };

/// How patches are dealt to ranks; never changes a result.
enum class Partition { metis, curve, round_robin };

struct ParallelOptions {
  Partition partition = Partition::metis;
  int balance_every = 50;  // steps between looks at the balance; 0: never
  double imbalance = 1.1;  // largest over mean work of the ranks from which patches are dealt out anew
};

struct SolverOptions {
  ShapeFunction shape = ShapeFunction::gimp;
  StressUpdate stress_update = StressUpdate::both;
  double flip = 1.0;        // 1: FLIP, 0: PIC
  bool spin = true;         // points carry an angular velocity
  int points_per_cell = 4;  // total; a square (2D) or cube (3D) number
  Motion motion = Motion::centred;
  Surface surface = Surface::cut;
  NoiseFilter noise_filter = NoiseFilter::weak;
  int noise_order = 4;  // times that motion goes to the nodes and back before what is left counts as noise
  LostPoints lost_points = LostPoints::stop;
  double energy_limit = 0;  // largest relative error of the energy book before the run fails; 0: off
};

/// What takes motion away on the way to rest (src/solver/damping.cpp).
struct DampingOptions {
  double local = 0;    // Cundall's: share of a point's acceleration that works against its velocity
  double viscous = 0;  // rate at which velocities fade [1/s]
  bool relax = false;  // all motion is taken away whenever the kinetic energy has passed a peak
  bool active() const { return local > 0 || viscous > 0 || relax; }
  friend bool operator==(const DampingOptions&, const DampingOptions&) = default;
};

/// Overrides for one pair of materials. The name "wall" stands for wall faces.
struct ContactPair {
  int material_a = 0, material_b = 0;  // indices of materials; -1: wall faces
  ContactLaw law = ContactLaw::friction;
  double friction = 0;  // may be infinite
};

struct ContactOptions {
  ContactLaw law = ContactLaw::friction;
  Release release = Release::reaction;
  double friction = 0.3;  // may be infinite
  GapRule gap = GapRule::pressure;
  double fill = 0.8;           // share of a node that the stand-off leaves filled; for GapRule::fill
  double impulse_limit = 0.0;  // gamma of Bardenhagen et al. 2001, eq. 21; 0: off
  NormalSource normals = NormalSource::volume_gradient;
  NormalChoice normal_choice = NormalChoice::common;
  Gate gate = Gate::node;
  DepartingFriction departing_friction = DepartingFriction::none;
  Passes passes = Passes::both;
  double separation = 0.0;  // [cells]; 0: no gate
  std::vector<ContactPair> pairs;
};

}  // namespace cairn
