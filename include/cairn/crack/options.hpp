#pragma once
/// Cracks as the case file gives them (docs/cracks.md).

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "cairn/body/solid.hpp"

namespace cairn {

/// What passes between a crack's faces.
enum class CrackLaw { stick, friction, frictionless, free, interface, cohesive };
/// An end inside the body, or at or beyond its surface.
enum class CrackEnd { open, tip };

/// Stiffness of an imperfect interface [Pa/m]; infinite: perfect in that direction.
struct InterfaceSpec {
  double opening = std::numeric_limits<double>::infinity();
  double closing = std::numeric_limits<double>::infinity();
  double sliding = std::numeric_limits<double>::infinity();
};

enum class CohesiveShape { triangle, linear, exponential };
/// A cohesive law, for opening and for slip.
struct CohesiveSpec {
  CohesiveShape shape = CohesiveShape::triangle;
  std::array<double, 2> strength = {0, 0};  // [Pa]
  std::array<double, 2> energy = {0, 0};    // G_c [J/m2]
  double peak = 0.1;                        // of a triangle: opening of the strength over the critical one
  double exponent = 1;                      // of mixed modes; 0: they debond each for itself
  std::array<double, 2> range = {0, std::numeric_limits<double>::infinity()};  // along the crack's line [m]
};

enum class GrowthCriterion { none, hoop, energy, steady };
enum class GrowthDirection { straight, hoop };
struct GrowthSpec {
  GrowthCriterion criterion = GrowthCriterion::none;
  GrowthDirection direction = GrowthDirection::straight;
  double toughness = 0;  // K_Ic [Pa m^1/2], of hoop
  double energy = 0;     // J_c [J/m2], of energy; of steady: at which it starts, 0: at `start`
  double speed = 0;      // of steady [m/s]
  double start = 0;      // of steady [s]
  double most = std::numeric_limits<double>::infinity();  // growth of a tip at which it ends [m]
  double length = 0.5;                                    // of a new segment [cells]
  int every = 5;                                          // steps
  bool cohesive = false;                                  // the new segment has the crack's cohesive law
};

/// A plane, round crack; the normal points to what is above.
struct CrackDisk {
  Vec3 centre = Vec3::Zero(), normal = Vec3::UnitZ();
  double radius = 0;  // [m]
};
/// A crack in the form of a surface from a file.
struct CrackFile {
  std::string name;     // as the case file has it
  double scale = 1;     // metres in a unit of the file
  Triangles triangles;  // [m]; points that several share are one, and neighbours agree on what is above
};

struct CrackSpec {
  std::vector<Vec3> points;  // [m], in the crack's direction
  // In 3D one of: `points` drawn out along `extrude` [m], so that extrude x direction points to what is above; a disk;
  // a file.
  Vec3 extrude = Vec3::Zero();
  std::optional<CrackDisk> disk;
  std::optional<CrackFile> file;
  // In 3D the rim is sorted by the bodies' shapes; the last end stands for it, and is a tip where some of it is.
  std::array<CrackEnd, 2> ends = {CrackEnd::open, CrackEnd::open};
  CrackLaw law = CrackLaw::friction;
  double friction = 0.3;
  InterfaceSpec interface;  // of law interface
  CohesiveSpec cohesive;    // of law cohesive, and of what grows
  GrowthSpec growth;
  std::vector<std::string> groups;  // of the bodies that it cuts
  std::vector<int> ids;             // or those bodies; both empty: all that are not rigid
  std::string source;               // where it was defined, for messages

  bool is_surface() const { return disk || file || !extrude.isZero(0); }
  bool has_tractions() const { return law == CrackLaw::interface || law == CrackLaw::cohesive || growth.cohesive; }
  bool cuts_all() const { return groups.empty() && ids.empty(); }  // that are not rigid
  bool cuts(int body, const std::string& group) const {
    return cuts_all() || std::ranges::find(groups, group) != groups.end() || std::ranges::find(ids, body) != ids.end();
  }
};

struct CrackOptions {
  std::array<double, 2> j_radius = {1, 4};  // [cells]: where the weight of the J-integral begins to fall, and ends
  int split = 0;  // steps after which parts that cracks cut off become bodies of their own; 0: never
};

}  // namespace cairn
