// [materials], [[bodies]] and [[grains]].

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "cairn/material/registry.hpp"
#include "case_names.hpp"
#include "case_sections.hpp"
#include "shape_copies.hpp"
#include "shape_files.hpp"

namespace cairn::reading {
namespace {

constexpr int most_pressure_errors = 20;  // reported for one case

bool has_parameter(const LawInfo& law, std::string_view key) {
  return std::ranges::find(law.parameters, key, &Parameter::key) != law.parameters.end();
}

/// Young's modulus and Poisson's ratio instead of the shear and bulk moduli; true when the pair was used.
bool read_youngs_pair(Table& table, const LawInfo& law, ParameterValues& values) {
  constexpr std::string_view youngs = "youngs_modulus", poissons = "poissons_ratio";
  if (!has_parameter(law, "shear_modulus") || !has_parameter(law, "bulk_modulus")) return false;
  const bool direct = table.has("shear_modulus") || table.has("bulk_modulus");
  const bool has_youngs = table.has(youngs), has_poissons = table.has(poissons);
  if (!has_youngs && !has_poissons) {
    if (!direct)
      table.missing("shear_modulus",
                    "is missing; give shear_modulus and bulk_modulus, or youngs_modulus and poissons_ratio");
    return !direct;
  }
  const std::string_view given = has_youngs ? youngs : poissons;
  if (direct) {
    table.error(given, "is given beside shear_modulus or bulk_modulus; give one pair of the two");
    return true;
  }
  const double E = table.number(youngs, std::nullopt, positive);
  const double nu = table.number(poissons, std::nullopt, {-1, 0.5, true, true});
  values["shear_modulus"] = E / (2 * (1 + nu));
  values["bulk_modulus"] = E / (3 * (1 - 2 * nu));
  return true;
}

/// An array of 1 to `p.most` numbers, each under its own key.
void read_list(Table& table, const Parameter& p, const Range& range, ParameterValues& values) {
  const std::size_t before = table.error_count();
  const auto list = table.numbers(p.key, range);
  if (table.error_count() != before) return;
  if (list.empty() || std::ssize(list) > p.most)
    return table.error(p.key, fmt::format("holds {} numbers; must hold 1 to {}", list.size(), p.most));
  for (std::ptrdiff_t i = 0; i < std::ssize(list); ++i) values[list_key(p.key, i)] = list[i];
  if (p.as_many_as.empty() || !values.contains(list_key(p.as_many_as, 0))) return;
  std::size_t other = 0;
  while (values.contains(list_key(p.as_many_as, other))) ++other;
  if (other != list.size())
    table.error(p.key,
                fmt::format("holds {} numbers, {} holds {}; both must hold as many", list.size(), p.as_many_as, other));
}

Plane read_plane(Table& table, const LawInfo& law, int dimension) {
  if (!table.has("plane")) return Plane::strain;
  const Plane plane = table.choice("plane", plane_names, Plane::strain);
  if (dimension != 2) {
    table.error("plane",
                "is only for 2D; the case has dimension 3, where stress and strain are as the motion makes them");
  } else if (!law.has_plane_stress) {
    table.error("plane",
                fmt::format("the model {} has no plane of stress or strain; remove this key", in_quotes(law.name)));
  }
  return plane;
}

Material read_material(Table table, const std::string& name, int dimension) {
  Material material;
  material.name = name;
  std::vector<std::string_view> models;
  for (const auto& law : law_infos()) models.push_back(law.name);
  if (!table.has("model")) table.missing("model", "is missing; choose one of " + listed(models));
  const std::size_t choice = table.choose("model", models);
  const bool rigid = choice < models.size() && models[choice] == "rigid";
  material.density = table.number("density", rigid ? std::optional(1.0) : std::nullopt, positive);
  if (choice >= models.size()) return material;  // without the model the other keys mean nothing
  material.model = models[choice];
  const LawInfo& law = *find_law(material.model);
  const bool pair = read_youngs_pair(table, law, material.parameters);
  for (const auto& p : law.parameters) {
    const std::string key(p.key);
    if (pair && (key == "shear_modulus" || key == "bulk_modulus")) {
      table.has(key);
      continue;
    }
    const Range range{p.lower, p.upper, !p.lower_allowed};
    if (!table.has(key) && !p.fallback) {
      table.missing(key, fmt::format("is missing; the {} [{}] {}", p.meaning, p.unit, range.text()));
    } else if (p.most > 0) {
      read_list(table, p, range, material.parameters);
    } else {
      material.parameters[key] = table.number(key, p.fallback, range);
    }
  }
  material.plane = read_plane(table, law, dimension);
  table.finish();
  return material;
}

/// Index of the material a table names; 0 after an error.
int read_material_name(Table& table, const std::vector<Material>& materials, bool required) {
  if (!table.has("material")) {
    if (required) table.missing("material", "is missing; name one of " + material_list(materials));
    return -1;
  }
  const bool wrong_type = !table.find("material")->is_string();
  const std::string name = table.text("material", std::nullopt);
  const int found = find_material(materials, name);
  if (found < 0 && !wrong_type)
    table.error("material",
                fmt::format("{} is not a material; known are {}", in_quotes(name), material_list(materials)));
  return std::max(0, found);
}

/// The name of a table's copy beside the results; a table that is read twice has one.
std::string add_table(std::vector<CaseTable>& tables, const std::filesystem::path& file, std::uint64_t checksum) {
  const auto known = std::ranges::find(tables, file, &CaseTable::file);
  if (known != tables.end()) return known->copy;
  tables.push_back({file, fmt::format("case_grains_{}.csv", tables.size()), checksum});
  return tables.back().copy;
}

}  // namespace

void check_ids(Table& table, std::string_view key, const std::vector<int>& ids, const Draft& draft) {
  const auto count = std::ssize(draft.result.bodies);
  for (const int id : ids)
    if (id >= count && draft.bodies_known)
      return table.error(key, fmt::format("body {} does not exist; the bodies are 0 to {}", id, count - 1));
}

int find_material(const std::vector<Material>& materials, std::string_view name) {
  for (std::size_t i = 0; i < materials.size(); ++i)
    if (materials[i].name == name) return static_cast<int>(i);
  return -1;
}

std::string material_list(const std::vector<Material>& materials) {
  std::vector<std::string_view> names;
  for (const auto& m : materials) names.push_back(m.name);
  return names.empty() ? "none" : listed(names);
}

Vec3 read_angular_velocity(Table& table, int dimension) {
  if (dimension == 3) return table.vector("angular_velocity", 3, Vec3::Zero().eval());
  return {0, 0, table.number("angular_velocity", 0.0)};
}

void read_materials(Table materials, int dimension, std::vector<Material>& result) {
  for (const auto& name : materials.keys()) result.push_back(read_material(materials.table(name), name, dimension));
  if (result.empty()) materials.missing("", "no material is given; give at least one table [materials.NAME]");
}

CommonSpec read_common(Table& table, const Draft& draft) {
  const int dimension = draft.result.domain.dimension;
  CommonSpec spec;
  spec.material = read_material_name(table, draft.result.materials, false);
  spec.velocity = table.vector("velocity", dimension, Vec3::Zero().eval());
  spec.angular_velocity = read_angular_velocity(table, dimension);
  spec.initial_pressure = table.number("initial_pressure", 0.0);
  spec.group = table.text("group", "");
  return spec;
}

std::filesystem::path path_of_file(const std::string& name, Table& table, const Draft& draft, std::string_view key) {
  const std::filesystem::path path = (draft.result.file.parent_path() / name).lexically_normal();
  std::error_code status;
  if (std::filesystem::exists(path, status)) return path;
  table.error(key, fmt::format("there is no file {}; the name is relative to the folder of the case file",
                               in_quotes(path.string())));
  return {};
}

std::string add_copy(std::vector<CaseTable>& tables, const std::filesystem::path& file, std::uint64_t checksum) {
  const std::string name = copy_name(file, checksum);
  if (std::ranges::find(tables, name, &CaseTable::copy) == tables.end())
    tables.push_back({std::filesystem::absolute(file).lexically_normal(), name, checksum, false});
  return name;
}

void read_bodies(Table& root, Draft& draft, Errors& errors) {
  const Domain& domain = draft.result.domain;
  for (Table& table : root.tables("bodies")) {
    BodySpec body;
    body.source = table.where().text();
    std::vector<Shape> shapes = {Ball{0.5 * (domain.lower + domain.upper), 0}};  // for what does not read
    if (!table.has("shape"))
      table.missing("shape", "is missing; give a table such as { type = \"disk\", centre = [0, 0], radius = 1 }");
    if (Table shape = table.table("shape"); shape.present()) {
      if (auto read = read_shape(shape, draft, errors)) {
        const std::size_t before = errors.count();
        shapes = one_by_one(*read, shape, draft);
        for (const Shape& one : shapes) {
          if (errors.count() != before) break;
          const std::string problem = draft.domain_known ? placement_problem(one, domain) : "";
          if (!problem.empty()) table.error("shape", problem);
        }
      }
    }
    body.material = read_material_name(table, draft.result.materials, true);
    body.velocity = table.vector("velocity", domain.dimension, Vec3::Zero().eval());
    body.angular_velocity = read_angular_velocity(table, domain.dimension);
    body.initial_pressure = table.number("initial_pressure", 0.0);
    body.group = table.text("group", "");
    table.finish();
    for (Shape& one : shapes) {
      body.shape = std::move(one);
      draft.result.bodies.push_back(body);
    }
  }
  draft.shaped_bodies = draft.result.bodies.size();
}

GrainsSpec read_grains_spec(Table& table, Draft& draft) {
  GrainsSpec spec{read_common(table, draft), {}, {}, {}};
  if (!table.has("file")) return spec;
  const std::string name = table.text("file", std::nullopt);
  if (name.empty()) {
    if (table.find("file")->is_string()) table.error("file", "is empty; name a grain table");
  } else {
    spec.given = path_of_file(name, table, draft);
  }
  if (spec.given.empty())
    draft.bodies_known = false;
  else
    spec.file = std::filesystem::absolute(spec.given).lexically_normal();
  return spec;
}

std::string read_table(const GrainsSpec& spec, Draft& draft, Errors& errors) {
  const bool known = std::exchange(draft.bodies_known, false);  // until the table has been read
  const std::size_t before = errors.count();
  const std::uint64_t checksum = read_grain_table(spec.given, spec, draft, errors);
  draft.bodies_known = known && errors.count() == before;
  return add_table(draft.result.tables, spec.file, checksum);
}

void read_grains(Table& root, Draft& draft, Errors& errors) {
  for (Table& table : root.tables("grains")) {
    GrainsSpec spec = read_grains_spec(table, draft);
    if (!table.has("file")) table.missing("file"), draft.bodies_known = false;
    table.finish();
    if (spec.file.empty()) continue;
    spec.copy = read_table(spec, draft, errors);
    draft.grains.push_back(std::move(spec));
  }
}

void check_pressures(const Draft& draft, Errors& errors) {
  const Case& c = draft.result;
  int reported = 0;
  for (int i = 0; i < std::ssize(c.bodies) && reported < most_pressure_errors; ++i) {
    const BodySpec& body = c.bodies[i];
    const Material* material = material_of(c, body);
    if (body.initial_pressure == 0 || !material) continue;
    const LawInfo* law = find_law(material->model);
    std::string problem;
    if (law && !law->has_pressure)
      problem = fmt::format("the model {} of the body's material carries no stress", in_quotes(law->name));
    else if (material->plane == Plane::stress)
      problem = "the body's material is in plane stress, which a hydrostatic pressure is not";
    if (problem.empty()) continue;
    errors.add({body.source, 0}, "initial_pressure", problem + "; remove this key or set it to 0");
    ++reported;
  }
}

}  // namespace cairn::reading
