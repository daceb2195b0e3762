// [[labels]]: bodies from an image or a volume of labels.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>

#include "cairn/core/error.hpp"
#include "cairn/io/checksum.hpp"
#include "case_sections.hpp"
#include "label_file.hpp"

namespace cairn::reading {
namespace {

/// Materials and groups by label, from CSV with the columns label, material and, perhaps, group.
struct LabelTable {
  struct Row {
    int material = -1;
    std::string group;
  };
  std::map<std::int64_t, Row> rows;
};

std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    std::string_view cell = line.substr(begin, end - begin);
    while (!cell.empty() && std::isspace(static_cast<unsigned char>(cell.front()))) cell.remove_prefix(1);
    while (!cell.empty() && std::isspace(static_cast<unsigned char>(cell.back()))) cell.remove_suffix(1);
    cells.emplace_back(cell);
    begin = end + 1;
  }
  return cells;
}

LabelTable read_label_table(const std::filesystem::path& path, std::string_view text, const Draft& draft,
                            Errors& errors) {
  constexpr std::size_t most_errors = 20;
  const auto& materials = draft.result.materials;
  LabelTable table;
  std::vector<std::string> header;
  std::int64_t line = 0;
  std::size_t found = 0;
  const auto fail = [&](std::string_view key, const std::string& problem) {
    if (++found <= most_errors) errors.add({path.string(), line}, key, problem);
  };
  text = without_mark(text);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const auto cells = cells_of(text.substr(begin, end - begin));
    begin = end + 1, ++line;
    if (cells[0].starts_with('#') || (cells.size() == 1 && cells[0].empty())) continue;
    if (header.empty()) {
      header = cells;
      for (const auto& name : header)
        if (name != "label" && name != "material" && name != "group")
          fail("", fmt::format("{} is not a column; the header must be label,material[,group]", in_quotes(name)));
      if (std::ranges::find(header, "label") == header.end() || std::ranges::find(header, "material") == header.end())
        fail("", "the header must be label,material[,group]");
      if (found > 0) return table;
      continue;
    }
    if (cells.size() != header.size()) {
      fail("", fmt::format("has {} values; the header names {} columns", cells.size(), header.size()));
      continue;
    }
    const auto cell = [&](std::string_view name) {
      const auto at = std::ranges::find(header, name);
      return at == header.end() ? std::string() : cells[static_cast<std::size_t>(at - header.begin())];
    };
    std::int64_t label = 0;
    const std::string digits = cell("label");
    const auto [stop, status] = std::from_chars(digits.data(), digits.data() + digits.size(), label);
    if (stop != digits.data() + digits.size() || status != std::errc{})
      fail("label", fmt::format("{} is not a whole number", in_quotes(digits)));
    const int material = find_material(materials, cell("material"));
    if (material < 0)
      fail("material",
           fmt::format("{} is not a material; known are {}", in_quotes(cell("material")), material_list(materials)));
    if (!table.rows.try_emplace(label, LabelTable::Row{material, cell("group")}).second)
      fail("label", fmt::format("{} is there twice", label));
  }
  return table;
}

/// The bodies of a volume, in the order of its labels.
void add_bodies(const LabelsSpec& spec, const LabelTable& given, const std::shared_ptr<const LabelVolume>& volume,
                Table& table, Draft& draft) {
  constexpr int most_errors = 20;
  int found = 0;
  const Place place(spec.placement);
  for (int i = 0; i < volume->count(); ++i) {
    const LabelFacts& facts = volume->facts(i);
    BodySpec body;
    body.shape = LabelBody{volume, i, place, place.in_space(facts.box), spec.checksum};
    const auto row = given.rows.find(facts.label);
    body.material = row != given.rows.end() ? row->second.material : spec.common.material;
    body.group = row != given.rows.end() && !row->second.group.empty() ? row->second.group : spec.common.group;
    body.velocity = spec.common.velocity, body.angular_velocity = spec.common.angular_velocity;
    body.initial_pressure = spec.common.initial_pressure;
    body.source = fmt::format("{}: label {}", table.where().text(), facts.label);
    if (body.material < 0 && ++found <= most_errors)
      table.error(spec.table.empty() ? "material" : "table",
                  fmt::format("label {} has no material; name it in the table, or one for all labels by the key "
                              "material",
                              facts.label));
    body.material = std::max(0, body.material);
    const std::string misplaced = draft.domain_known ? placement_problem(body.shape, draft.result.domain) : "";
    if (!misplaced.empty() && ++found <= most_errors)
      table.error("file", fmt::format("label {}: {}", facts.label, misplaced));
    draft.result.bodies.push_back(std::move(body));
  }
  for (const auto& [label, row] : given.rows) {
    const auto is_it = [&, wanted = label](int i) { return volume->facts(i).label == wanted; };
    bool there = false;
    for (int i = 0; i < volume->count() && !there; ++i) there = is_it(i);
    if (!there && ++found <= most_errors) table.error("table", fmt::format("the file has no label {}", label));
  }
}

void read_labels_file(LabelsSpec& spec, const std::string& name, const std::string& table_name, Table& table,
                      Draft& draft, Errors& errors) {
  const std::filesystem::path path = path_of_file(name, table, draft);
  if (path.empty()) return;
  LabelTable given;
  if (!table_name.empty()) {
    const std::filesystem::path table_path = path_of_file(table_name, table, draft, "table");
    if (table_path.empty()) return;
    const std::string text = read_text(table_path, "a table of labels (CSV)");
    given = read_label_table(table_path, text, draft, errors);
    spec.table = add_copy(draft.result.tables, table_path, checksum(std::span<const char>(text)));
  }
  const auto volume = open_labels(path, spec.checksum);
  if (volume->dimension() != draft.result.domain.dimension)
    return table.error("file", fmt::format("holds labels in {} dimensions; the case has {}", volume->dimension(),
                                           draft.result.domain.dimension));
  spec.copy = add_copy(draft.result.tables, path, spec.checksum);
  add_bodies(spec, given, volume, table, draft);
}

}  // namespace

void read_labels(Table& root, Draft& draft, Errors& errors) {
  for (Table& table : root.tables("labels")) {
    LabelsSpec spec;
    const std::string name = table.text("file", std::nullopt), table_name = table.text("table", "");
    spec.common = read_common(table, draft);
    const int dim = draft.result.domain.dimension;
    spec.placement.scale = table.number("scale", 1.0, positive);
    spec.placement.move = table.vector("move", dim, Vec3::Zero().eval());
    if (dim == 3)
      spec.placement.rotate = table.vector("rotate", 3, Vec3::Zero().eval());
    else
      spec.placement.rotate.z() = table.number("rotate", 0.0);
    table.finish();
    const std::size_t before = errors.count();
    try {
      if (!name.empty()) read_labels_file(spec, name, table_name, table, draft, errors);
    } catch (const InputError& error) {
      table.error("file", error.what());
    }
    draft.bodies_known = draft.bodies_known && errors.count() == before && !name.empty();
    draft.labels.push_back(std::move(spec));
  }
}

}  // namespace cairn::reading
