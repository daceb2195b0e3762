#pragma once
/// The sections of the case file, one function each. All report errors through their table and go on.

#include <map>
#include <memory>

#include "case_reader.hpp"

namespace cairn::reading {

/// What the bodies of a table share.
struct CommonSpec {
  int material = -1;  // -1: every row names its own
  Vec3 velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();
  double initial_pressure = 0;
  std::string group;
};

/// One [[grains]] entry: a table of balls and what they share.
struct GrainsSpec : CommonSpec {
  std::filesystem::path given, file;  // as the case has it, and absolute; empty where there is none
  std::string copy;                   // its name beside the results
};

/// One [[labels]] entry.
struct LabelsSpec {
  CommonSpec common;
  Placement placement;
  std::string copy, table;  // names of the copies beside the results
  std::uint64_t checksum = 0;
};

/// A solid of a file of triangles.
struct SolidPart {
  std::string name;
  std::string place;  // where it begins: "line 12" or "facet 400"
  Triangles triangles;
};
/// A closed line of a drawing.
struct LinePart {
  std::string name;
  std::vector<Vec3> points;
};
/// What was read from a file.
template <class T>
struct FileParts {
  std::shared_ptr<const T> content;
  std::uint64_t checksum = 0;
};

/// A case while it is read.
struct Draft {
  Case result;
  bool domain_known = false;                 // the domain was read without an error
  bool bodies_known = true;                  // every grain table was read, so that the number of bodies is right
  std::size_t shaped_bodies = 0;             // bodies from [[bodies]]; the rest come from the tables
  std::vector<GrainsSpec> grains;            // in order
  std::vector<std::string> inserted_tables;  // for each [[insert]] the copy of its table; empty where it has none
  std::vector<LabelsSpec> labels;
  std::map<std::string, FileParts<std::vector<SolidPart>>> surfaces;  // by file
  std::map<std::string, FileParts<std::vector<LinePart>>> outlines;
  std::map<std::string, std::shared_ptr<const Solid>> solids;  // that were made of them
};

/// The largest of the deformable materials; 1 where there is none.
struct Hardness {
  double wave_speed = 1;  // [m/s]
  double impedance = 1;   // density x wave speed [kg/(m2 s)]
};
Hardness hardness_of(const std::vector<Material>& materials);

void read_domain(Table domain, Domain& result);
/// [domain.deform]; after all that cannot be in a domain that deforms.
void read_deform(Table deform, Draft& draft);
/// `staged`: what ends the run may be a stage.
void read_time(Table time, bool staged, Time& result);
void read_solver(Table solver, int dimension, SolverOptions& result);
void read_damping(Table damping, StressUpdate update, DampingOptions& result);
void read_contact(Table contact, const std::vector<Material>& materials, ContactOptions& result);
/// After materials.
void read_boundary(Table boundary, Draft& draft);
void read_parallel(Table parallel, ParallelOptions& result);
void read_output(Table output, const Draft& draft, Output& result);
void read_materials(Table materials, int dimension, std::vector<Material>& result);
/// The shape a table describes; nothing after an error.
std::optional<Shape> read_shape(Table table, Draft& draft, Errors& errors);
/// The shape as TOML on one line, with the copies of its files.
std::string shape_text(const Shape& shape, int dimension);
/// Unit, scale, move and rotate.
Placement read_placement(Table& table, int dimension);
void read_bodies(Table& root, Draft& draft, Errors& errors);
void read_grains(Table& root, Draft& draft, Errors& errors);
/// [[insert]] and [[remove]]; after all other bodies.
void read_pouring(Table& root, Draft& draft, Errors& errors);
/// What the bodies of a table share, and where it is.
GrainsSpec read_grains_spec(Table& table, Draft& draft);
/// Appends the bodies of a table; returns the name of its copy.
std::string read_table(const GrainsSpec& spec, Draft& draft, Errors& errors);
void read_labels(Table& root, Draft& draft, Errors& errors);
void read_drives(Table& root, Draft& draft);
/// time.until and [[stage]], of a case that is right without them.
void read_stages(const toml::table& tree, Table& root, Draft& draft, Errors& errors);
/// A value as TOML on one line.
std::string inline_text(const toml::node& node);
/// The conditions as TOML.
std::string until_text(const Until& until);
/// [[cracks]] and [crack]; after bodies and contact.
void read_cracks(Table& root, Draft& draft);
/// Appends the cracks of an entry that lays one in many bodies.
void read_grain_cracks(Table table, const CrackSpec& crack, Draft& draft);
/// The keys of one of them for its surface, in 3D.
void read_crack_surface(Table& table, CrackSpec& crack, Draft& draft);
/// Reports surfaces outside the domain or all bodies; finds whether some of the rim is a tip.
void check_crack_surface(Table& table, const Case& c, CrackSpec& crack);
/// The keys of one of them for its faces and its growth; after its ends.
void read_crack_law(Table& table, CrackSpec& crack);

/// Material, velocities, pressure and group of the bodies of a table.
CommonSpec read_common(Table& table, const Draft& draft);
/// The file that a key names, relative to the case's; empty, and an error at the key, where there is none.
std::filesystem::path path_of_file(const std::string& name, Table& table, const Draft& draft,
                                   std::string_view key = "file");
/// The name of a file's copy beside the results; a file that is read twice has one.
std::string add_copy(std::vector<CaseTable>& tables, const std::filesystem::path& file, std::uint64_t checksum);

/// Appends the balls of a grain table; returns the checksum of its bytes.
std::uint64_t read_grain_table(const std::filesystem::path& file, const GrainsSpec& spec, Draft& draft, Errors& errors);

/// Reports ids of bodies that do not exist.
void check_ids(Table& table, std::string_view key, const std::vector<int>& ids, const Draft& draft);

/// Index of a material; -1 if there is none of that name.
int find_material(const std::vector<Material>& materials, std::string_view name);
/// Material names, for messages.
std::string material_list(const std::vector<Material>& materials);
/// Spin in 2D is one number, in 3D a vector.
Vec3 read_angular_velocity(Table& table, int dimension);

/// Reports bodies under initial pressure that cannot have one.
void check_pressures(const Draft& draft, Errors& errors);
/// What is wrong with the place of a body; empty when nothing is.
std::string placement_problem(const Shape& shape, const Domain& domain);
/// Adds the warnings: overlapping balls, bodies thinner than two cells, bodies held by a fixed face.
void warn_about_bodies(Case& result);
/// Bodies lie in front of the walls.
void check_walls(const Case& c, Errors& errors);
/// A body that gets no material point is an error.
void check_points(const Case& c, Errors& errors);

/// A body's material; null after an error in it.
const Material* material_of(const Case& c, const BodySpec& body);
/// Moves as prescribed, whatever the faces do.
bool is_prescribed(const Case& c, int index);
/// Refuses a fixed time step in which a wave or a point crosses more than a cell, and warns of one that nearly does.
void check_time_step(Case& c, Errors& errors);

/// The complete case file of a draft.
std::string write_case(const Draft& draft);

}  // namespace cairn::reading
