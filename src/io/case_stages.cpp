// What ends a run, and [[stage]].

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "case_names.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

/// Keys that a stage may change; * stands for one part.
constexpr std::string_view changing_keys[] = {"domain.gravity",
                                              "domain.deform",
                                              "time.cfl",
                                              "time.dt",
                                              "contact.friction",
                                              "contact.pair.*.friction",
                                              "boundary.*.velocity",
                                              "boundary.*.repeat",
                                              "boundary.*.friction",
                                              "boundary.*.piston",
                                              "boundary.*.servo",
                                              "drive.*.velocity",
                                              "drive.*.angular_velocity",
                                              "drive.*.repeat",
                                              "drive.*.piston",
                                              "drive.*.servo",
                                              "drive.*.rotor",
                                              "damping",
                                              "output"};

/// Whether `path` is a key of the pattern or lies below it.
bool fits(std::string_view path, std::string_view pattern) {
  while (!pattern.empty()) {
    const std::string_view want = pattern.substr(0, pattern.find('.')), part = path.substr(0, path.find('.'));
    if (part.empty() || (want != "*" && want != part)) return false;
    pattern.remove_prefix(std::min(pattern.size(), want.size() + 1));
    path.remove_prefix(std::min(path.size(), part.size() + 1));
  }
  return true;
}

/// Puts what a stage sets into the case before it; reports keys that cannot change.
class Changes {
 public:
  explicit Changes(Table& stage) : stage_(stage) {}

  void put(const toml::table& set, toml::node& into, const std::string& path) {
    for (const auto& [key, value] : set) {
      const std::string name(key.str()), at = path.empty() ? name : fmt::format("{}.{}", path, name);
      const bool known =
          at != "output.track" && std::ranges::any_of(changing_keys, [&](std::string_view k) { return fits(at, k); });
      toml::node* target = part_of(into, name);
      if (!target && !known && value.is_table() && into.is_table())
        target = &into.as_table()->insert_or_assign(key, toml::table{}).first->second;
      if (value.is_table() && target && (target->is_table() || target->is_array())) {
        put(*value.as_table(), *target, at);
      } else if (!known) {
        refuse(at);
      } else if (into.is_table()) {
        into.as_table()->insert_or_assign(key, value);
        drop_other(*into.as_table(), name);
      } else {
        stage_.error("set", fmt::format("{}: the case has no such entry", at));
      }
    }
  }

 private:
  static toml::node* part_of(toml::node& into, const std::string& name) {
    if (toml::table* table = into.as_table()) return table->get(name);
    const bool number =
        !name.empty() && name.size() < 9 && std::ranges::all_of(name, [](unsigned char c) { return std::isdigit(c); });
    return into.is_array() && number ? into.as_array()->get(std::stoul(name)) : nullptr;
  }
  /// A piston takes the place of a servo, a force that of a pressure, and the other way.
  static void drop_other(toml::table& table, const std::string& name) {
    for (const auto& [a, b] :
         {std::pair("piston", "servo"), std::pair("force", "pressure"), std::pair("strain_rate", "stress")})
      if (name == a || name == b) table.erase(name == a ? b : a);
    if (name == "force") table.erase("area");
    if (name == "strain_rate") table.erase("viscosity"), table.erase("memory"), table.erase("largest_rate");
  }
  void refuse(const std::string& at) {
    stage_.error("set", fmt::format("{} cannot change in a run; what can is {}", at, listed(changing_keys)));
  }
  Table& stage_;
};

/// Names of what feels a force; of walls and fixed faces those of the case; and a domain that deforms.
std::vector<std::string> tool_names(const Case& c) {
  std::vector<std::string> names;
  for (int f = 0; f < 2 * c.domain.dimension; ++f)
    if (c.faces[f].type == FaceType::wall || c.faces[f].type == FaceType::fixed) names.emplace_back(face_names[f]);
  for (std::size_t d = 0; d < c.drives.size(); ++d)
    names.push_back(c.drives[d].group.empty() ? fmt::format("drive{}", d) : c.drives[d].group);
  if (std::ranges::count(c.domain.periodic, true) > 0) names.emplace_back(whole_domain);
  return names;
}

Until read_until(Table table, const Case& c) {
  Until u;
  const auto limit = [&](const char* key, double& value, const Range& range) {
    if (table.has(key)) value = table.number(key, std::nullopt, range);
  };
  limit("time", u.time, positive), limit("duration", u.duration, positive);
  limit("strain", u.strain, positive), limit("force", u.force, not_negative),
      limit("pressure", u.pressure, not_negative);
  limit("packing", u.packing, positive), limit("length", u.length, positive), limit("area", u.area, positive);
  if (table.has("rest")) u.rest = table.number("rest", std::nullopt, {0, 1, true, true});
  u.falls = table.boolean("falls", false);
  u.every = static_cast<int>(table.integer("every", u.every, 1, 1'000'000));
  const bool tool = std::isfinite(u.strain) || std::isfinite(u.force) || std::isfinite(u.pressure);
  if (tool) {
    u.of = table.text("of", std::nullopt);
    const auto names = tool_names(c);
    const std::vector<std::string_view> views(names.begin(), names.end());
    if (std::ranges::find(names, u.of) == names.end() && table.has("of"))
      table.error("of", fmt::format("{} feels no force; choose one of {}", in_quotes(u.of), listed(views)));
    const bool face = u.of == whole_domain || std::ranges::find(face_names, u.of) != face_names.end();
    if (u.of == whole_domain && std::isfinite(u.force)) table.error("force", "is none of the domain; give pressure");
    if (!face && std::isfinite(u.strain) && u.length == 0)
      table.missing("length", "is missing; the strain of a drive needs the length that it refers to [m]");
    if (!face && std::isfinite(u.pressure) && u.area == 0)
      table.missing("area", "is missing; the pressure on a drive needs its area [m2; in 2D m]");
  }
  if (table.present() && !u.given())
    table.error("", "says nothing; give time, duration, strain, force, pressure, packing or rest");
  table.finish();
  return u;
}

/// The case with a stage's changes, without its bodies and cracks, which no stage changes: read as a whole, so that
/// every rule holds.
std::shared_ptr<const Case> read_changed(const toml::table& tree, Table& stage, Draft& draft, Errors& errors) {
  Draft next;
  Case &c = next.result, &base = draft.result;
  next.domain_known = true;
  Table root(&tree, "", stage.where(), errors);
  c.file = base.file, c.materials = base.materials;
  read_domain(root.table("domain"), c.domain);
  Table time = root.table("time");
  c.time = base.time;
  c.time.cfl = time.number("cfl", 0.4, {0, 1, true});
  c.time.dt = time.has("dt") ? time.number("dt", std::nullopt, positive) : 0;
  read_solver(root.table("solver"), c.domain.dimension, c.solver);
  read_contact(root.table("contact"), c.materials, c.contact);
  const auto lend = [&] {
    std::swap(c.bodies, base.bodies), std::swap(c.cracks, base.cracks), std::swap(c.inserts, base.inserts);
  };
  lend();
  read_drives(root, next);
  read_deform(root.table("domain").table("deform"), next);
  read_boundary(root.table("boundary"), next);
  read_damping(root.table("damping"), c.solver.stress_update, c.damping);
  read_output(root.table("output"), next, c.output);
  lend();
  return std::make_shared<const Case>(std::move(c));
}

}  // namespace

std::string inline_text(const toml::node& node) {
  std::string text;
  const auto add = [&](const std::string& entry) { text += (text.empty() ? "" : ", ") + entry; };
  if (const auto* table = node.as_table()) {
    for (const auto& [key, value] : *table) add(fmt::format("\"{}\" = {}", key.str(), inline_text(value)));
    return "{ " + text + " }";
  }
  if (const auto* array = node.as_array()) {
    for (const auto& entry : *array) add(inline_text(entry));
    return "[" + text + "]";
  }
  if (const auto* value = node.as_string()) {
    std::ostringstream stream;
    stream << toml::toml_formatter{toml::array{value->get()}};
    const std::string list = stream.str();
    return list.substr(list.find_first_of("\"'"), list.find_last_of("\"'") - list.find_first_of("\"'") + 1);
  }
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  if (const auto* value = node.as_integer()) return std::to_string(value->get());
  const double number = node.value_or(0.0);
  const std::string plain = fmt::format("{}", number);
  return std::isfinite(number) && plain.find_first_of(".e") == std::string::npos ? plain + ".0" : plain;
}

void read_stages(const toml::table& tree, Table& root, Draft& draft, Errors& errors) {
  Case& c = draft.result;
  Table time = root.table("time");
  if (time.has("until")) c.time.until = read_until(time.table("until"), c);
  std::vector<Table> stages = root.tables("stage");
  if (errors.count() > 0) return;  // else they would be told again for each stage
  toml::table changed = tree;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    Table& table = stages[i];
    RunStage stage;
    stage.name = table.text("name", fmt::format("stage {}", i));
    stage.until = read_until(table.table("until"), c);
    if (i + 1 < stages.size() && !stage.until.given())
      table.missing("until", "is missing; only the last stage can go on to the end of the run");
    if (Table set = table.table("set"); set.present()) {
      const toml::table& values = *table.find("set")->as_table();
      Changes(table).put(values, changed, "");
      stage.set = inline_text(values);
    }
    table.finish();
    if (errors.count() == 0) stage.changed = read_changed(changed, table, draft, errors);
    c.stages.push_back(std::move(stage));
  }
  if (!std::isfinite(c.time.end) && c.time.steps == Time{}.steps && !c.time.until.given() &&
      !(c.stages.empty() || c.stages.back().until.given()))
    time.missing("end", "is missing, and the last stage has no end either; give time.end, or until there");
}

std::string until_text(const Until& u) {
  std::string text;
  const auto add = [&](const char* key, const std::string& value) {
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", key, value);
  };
  const auto number = [&](const char* key, double value, bool given) {
    if (given) add(key, inline_text(toml::value<double>(value)));
  };
  number("time", u.time, std::isfinite(u.time)), number("duration", u.duration, std::isfinite(u.duration));
  number("strain", u.strain, std::isfinite(u.strain)), number("force", u.force, std::isfinite(u.force));
  number("pressure", u.pressure, std::isfinite(u.pressure)), number("packing", u.packing, std::isfinite(u.packing));
  number("rest", u.rest, u.rest > 0), number("length", u.length, u.length > 0), number("area", u.area, u.area > 0);
  if (!u.of.empty()) add("of", inline_text(toml::value<std::string>(u.of)));
  if (u.falls) add("falls", "true");
  add("every", std::to_string(u.every));
  return "{ " + text + " }";
}

}  // namespace cairn::reading
