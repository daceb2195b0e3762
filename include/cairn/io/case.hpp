#pragma once
/// The case: everything a run needs, parsed, checked and with all defaults filled in (INTERFACE: docs/case-file.md).
/// Vectors have three components whatever the dimension; z is 0 in 2D. SI units.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cairn/body/shape.hpp"
#include "cairn/body/tool.hpp"
#include "cairn/core/options.hpp"
#include "cairn/crack/options.hpp"

namespace cairn {

/// How the length of a periodic domain along an axis changes.
struct AxisDeformation {
  enum class By { nothing, strain_rate, stress } by = By::nothing;
  MotionTable target;       // x: strain rate [1/s], or the mean stress, positive in tension [Pa]
  double viscosity = 0;     // of a stress: how much of it is missing for a strain rate of 1 [Pa s]
  double memory = 0;        // of a stress: the time in which one that is missing doubles that rate [s]
  double largest_rate = 0;  // of a stress [1/s]
  bool active() const { return by != By::nothing; }
};

/// A periodic domain that deforms, and all that is in it with it.
struct Deformation {
  std::array<AxisDeformation, 3> axes;
  bool active() const { return std::ranges::any_of(axes, &AxisDeformation::active); }
};

struct Domain {
  int dimension = 2;
  Vec3 lower = Vec3::Zero(), upper = Vec3::Zero();  // [m]
  std::array<int, 3> cells = {1, 1, 1};
  std::array<bool, 3> periodic = {false, false, false};
  MotionTable gravity;  // [m/s2]
  int patch_cells = 0;  // 32 in 2D, 16 in 3D unless given
  Deformation deformation;
};

/// The shortest side of a cell [m].
double smallest_cell(const Domain& domain);

/// The name of a domain that deforms where a tool is named: its strain is the largest of its axes', its pressure the
/// negative mean of the stresses along them.
inline constexpr const char* whole_domain = "domain";

/// What ends a stage, or the run: any of what is given. Forces are means since the last look.
struct Until {
  static constexpr double never = std::numeric_limits<double>::infinity();
  double time = never;                                     // simulated [s]
  double duration = never;                                 // since the stage began [s]
  std::string of;                                          // the tool that is meant, by its name
  double strain = never, force = never, pressure = never;  // [-, N, Pa], in size
  bool falls = false;                                      // force or pressure come down to that, not up
  double length = 0, area = 0;                             // to which strain and pressure refer; 0: of the face
  double packing = never;                                  // volume of bodies over that between the walls
  double rest = 0;                                         // unbalanced_force below this; 0: not asked
  int every = 10;                                          // steps between looks
  bool given() const {
    return std::isfinite(time) || std::isfinite(duration) || std::isfinite(strain) || std::isfinite(force) ||
           std::isfinite(pressure) || std::isfinite(packing) || rest > 0;
  }
};

struct Time {
  double end = std::numeric_limits<double>::infinity();  // [s]
  std::int64_t steps = std::numeric_limits<std::int64_t>::max();
  double cfl = 0.4;
  double dt = 0;          // fixed step [s]; 0: from cfl
  Until until;            // what else ends the run
  double wall_limit = 0;  // wall time after which the run stops with a checkpoint [s]; 0: none
};

struct Material {
  std::string name;
  std::string model;                         // a name of material/registry.hpp
  double density = 0;                        // [kg/m3]
  std::map<std::string, double> parameters;  // keyed as in the law's table, every one filled in; lists by list_key
  Plane plane = Plane::strain;               // in 2D
};

/// One body: its shape, material and rigid initial motion.
struct BodySpec {
  Shape shape;
  int material = 0;                      // index into Case::materials
  Vec3 velocity = Vec3::Zero();          // [m/s]
  Vec3 angular_velocity = Vec3::Zero();  // [rad/s] about the shape's centre
  double initial_pressure = 0;           // hydrostatic [Pa], positive in compression
  std::string group;
  int insert = -1;     // comes with this of Case::inserts, not at the start
  std::string source;  // where it was defined, for messages: "case.toml:31" or "pack.csv:12"
};

/// Bodies moved as rigid parts. Exactly one of the three selections is used.
struct Drive {
  int overlapping = -1;  // index into face_names: bodies whose shape reaches across that face; -1: unused
  double within = 0;     // with overlapping: or comes closer to it than this [m]
  std::vector<int> ids;
  std::string group;
  MotionTable velocity;          // [m/s]
  MotionTable angular_velocity;  // [rad/s] about each body's centre, or about one point
  std::optional<Vec3> about;     // that point at the start [m]
  Piston piston;
  Piston rotor;  // Tool::rotor
};

struct Face {
  FaceType type = FaceType::free;
  MotionTable velocity;               // of a fixed face or wall [m/s]
  double friction = 0;                // of a wall; may be infinite
  Leaving leaving = Leaving::remove;  // of a free face
  std::optional<double> position;     // of a wall, along its normal, at the start [m]; else on the face
  Piston piston;                      // of a wall, along its normal into the domain
};

/// A wall whose plane is not that of the domain's face, or will not be.
bool moves(const Face& face, int number);

/// Bodies that come into a running simulation, one after the other.
struct Insert {
  int first = 0, count = 0;                         // its bodies
  bool drawn = false;                               // their centres are drawn from the region, else as they are given
  Vec3 lower = Vec3::Zero(), upper = Vec3::Zero();  // of that region, which holds whole bodies [m]
  double start = 0, interval = 0;                   // time of the first, and between two at least [s]
  std::uint64_t seed = 1;                           // of what is drawn
  int every = 10;                                   // steps between attempts
  std::string text;                                 // the entry as it was given, for case.toml
};

/// Bodies whose centres of mass lie in a region leave.
struct Remove {
  Shape region;
  double start = 0, end = std::numeric_limits<double>::infinity();  // when [s]
  int every = 50;                                                   // steps between looks
};

/// When an output is written; several conditions may be given, none means never.
struct Schedule {
  std::int64_t every = 0;    // steps
  double interval = 0;       // simulated time [s]
  double interval_wall = 0;  // wall time [s]
  int keep = 2;              // checkpoints kept
  std::vector<std::string> fields;
  bool active() const { return every > 0 || interval > 0 || interval_wall > 0; }
};

struct Output {
  Schedule particles, grains, contacts, forces, tips, history, checkpoint;
  std::vector<int> track;  // bodies of bodies.csv
};

/// A grain table, or the file of a shape, that the case reads, and the name of its copy beside the case.toml of the
/// results.
struct CaseTable {
  std::filesystem::path file;
  std::string copy;
  std::uint64_t checksum = 0;  // of its bytes, as they were read (checksum.hpp)
  bool marked = true;          // the copy begins with a line that says whose it is; else it has the same bytes
};

struct RunStage;

struct Case {
  std::string title;
  std::filesystem::path file;  // where it was read from; grain tables are relative to its folder
  Domain domain;
  Time time;
  SolverOptions solver;
  ContactOptions contact;
  std::vector<Material> materials;
  std::vector<BodySpec> bodies;  // [[bodies]], then the rows of every [[grains]], then the labels of every [[labels]]
  std::vector<Drive> drives;
  std::vector<CrackSpec> cracks;
  CrackOptions crack;
  std::array<Face, 6> faces;
  DampingOptions damping;
  std::vector<Insert> inserts;
  std::vector<Remove> removes;
  std::vector<RunStage> stages;  // one after the other; none: one stage without a name
  Output output;
  ParallelOptions parallel;
  std::vector<std::string> warnings;
  std::string resolved;  // the text of case.toml: every default and override filled in, grain tables by their copies
  std::vector<CaseTable> tables;
};

/// A part of the run, with keys that change where it begins.
struct RunStage {
  std::string name;
  Until until;
  std::shared_ptr<const Case> changed;  // the case with all changes so far, without bodies
  std::string set;                      // the changes as they were given, for case.toml
};

/// True where the drive selects the body, which has the number `index`.
bool selects(const Drive& drive, const BodySpec& body, int index, const Domain& domain);

/// One `--set KEY=VALUE`.
struct Override {
  std::string key, value;
};

/// Reads and checks a case file and its grain tables. Every rank may call it (it only reads).
/// \throws InputError with every error found; each names file, line, key and remedy.
Case read_case(const std::filesystem::path& file, const std::vector<Override>& overrides = {});

}  // namespace cairn
