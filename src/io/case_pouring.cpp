// [[insert]] and [[remove]].

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "case_names.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

/// The region in which centres are drawn, as large as the domain where it is not given.
void read_region(Table& table, const Domain& domain, Insert& insert) {
  insert.lower = domain.lower, insert.upper = domain.upper;
  Table region = table.table("region");
  if (!region.present()) return;
  insert.lower = region.vector("lower", domain.dimension, std::nullopt);
  insert.upper = region.vector("upper", domain.dimension, std::nullopt);
  for (int k = 0; k < domain.dimension; ++k)
    if (!(insert.lower[k] < insert.upper[k]) || insert.lower[k] < domain.lower[k] || insert.upper[k] > domain.upper[k])
      region.error("lower",
                   fmt::format("the region spans [{}, {}] in direction {}; it must lie in the domain, [{}, {}]",
                               insert.lower[k], insert.upper[k], "xyz"[k], domain.lower[k], domain.upper[k]));
  region.finish();
}

/// Balls with radii drawn evenly from a range; the case and its seed decide, and nothing else.
std::vector<Shape> read_balls(Table& table, int count, const Insert& insert) {
  double least = 0, most = 0;
  if (table.find("radius")->is_array()) {
    const auto range = table.numbers("radius", positive);
    if (range.size() == 2) least = range[0], most = range[1];
    if (range.size() != 2 || least > most) table.error("radius", "must be a number, or the least and the largest");
  } else {
    least = most = table.number("radius", std::nullopt, positive);
  }
  std::mt19937_64 random(insert.seed);
  std::vector<Shape> balls;
  for (int i = 0; i < count; ++i) {
    const double share = static_cast<double>(random() >> 11) * 0x1p-53;
    balls.emplace_back(Ball{0.5 * (insert.lower + insert.upper), least + share * (most - least)});
  }
  return balls;
}

void read_times(Table& table, Insert& insert) {
  insert.start = table.number("start", 0.0, not_negative);
  insert.interval = table.number("interval", 0.0, not_negative);
  insert.every = static_cast<int>(table.integer("every", insert.every, 1, 1'000'000));
  insert.seed = static_cast<std::uint64_t>(table.integer("seed", 1, 0, std::numeric_limits<std::int64_t>::max()));
}

/// The entry as it was given, with the copies of its files.
std::string text_of(Table& table, const Insert& insert, const Draft& draft) {
  std::string text;
  const std::string& copy = draft.inserted_tables.back();
  for (const auto& key : table.keys()) {
    std::string value = inline_text(*table.find(key));
    if (key == "file" && !copy.empty()) value = inline_text(toml::value<std::string>(copy));
    if (key == "shape" && insert.count > 0)
      value = shape_text(draft.result.bodies[insert.first].shape, draft.result.domain.dimension);
    text += fmt::format("{} = {}\n", key, value);
  }
  return text;
}

/// Appends the bodies.
void add_bodies(Table& table, Draft& draft, Errors& errors, Insert& insert) {
  const Domain& domain = draft.result.domain;
  GrainsSpec spec = read_grains_spec(table, draft);
  const bool ball = table.has("radius"), shape = table.has("shape");
  if (!table.has("file") && ball == shape)
    return table.missing("radius", "give one of radius (disks or spheres), shape, or file (a grain table)");
  if (table.has("file")) {
    if (spec.file.empty()) return;
    if (ball || shape) table.error("file", "is given beside radius or shape; give one of them");
    spec.copy = read_table(spec, draft, errors);
    draft.inserted_tables.push_back(spec.copy);
    return;
  }
  if (spec.material < 0) table.missing("material", "is missing; name one of " + material_list(draft.result.materials));
  const int count = static_cast<int>(table.integer("count", 1, 1, 10'000'000));
  insert.drawn = ball || table.has("region");
  read_region(table, domain, insert);
  std::vector<Shape> shapes;
  if (ball) {
    shapes = read_balls(table, count, insert);
  } else if (auto read = read_shape(table.table("shape"), draft, errors)) {
    shapes.assign(count, *read);
  }
  for (const Shape& s : shapes) {
    const std::string problem = draft.domain_known ? placement_problem(s, domain) : "";
    const Bounds b = bounds(s);
    for (int k = 0; k < domain.dimension; ++k)
      if (insert.drawn && b.upper[k] - b.lower[k] > insert.upper[k] - insert.lower[k])
        return table.error("region", fmt::format("is too small in direction {} for a body {} wide", "xyz"[k],
                                                 b.upper[k] - b.lower[k]));
    if (!problem.empty()) return table.error("shape", problem);
    BodySpec body;
    body.shape = s, body.material = std::max(0, spec.material), body.velocity = spec.velocity;
    body.angular_velocity = spec.angular_velocity, body.initial_pressure = spec.initial_pressure;
    body.group = spec.group, body.source = table.where().text();
    draft.result.bodies.push_back(std::move(body));
  }
}

}  // namespace

void read_pouring(Table& root, Draft& draft, Errors& errors) {
  Case& c = draft.result;
  for (Table& table : root.tables("insert")) {
    Insert insert;
    insert.first = static_cast<int>(c.bodies.size());
    read_times(table, insert);
    const std::size_t tables = draft.inserted_tables.size();
    add_bodies(table, draft, errors, insert);
    if (draft.inserted_tables.size() == tables) draft.inserted_tables.emplace_back();
    insert.count = static_cast<int>(c.bodies.size()) - insert.first;
    for (std::size_t b = insert.first; b < c.bodies.size(); ++b) {
      c.bodies[b].insert = static_cast<int>(c.inserts.size());
      const Material* material = material_of(c, c.bodies[b]);
      if (material && material->model == "rigid") {
        table.error("material",
                    "is rigid; bodies that come later must be deformable: a drive moves those that are not");
        break;
      }
    }
    insert.text = text_of(table, insert, draft);
    table.finish();
    c.inserts.push_back(std::move(insert));
  }
  for (Table& table : root.tables("remove")) {
    Remove remove;
    if (!table.has("region")) table.missing("region", "is missing; give a shape");
    if (Table region = table.table("region"); region.present())
      if (auto shape = read_shape(region, draft, errors)) remove.region = *shape;
    remove.start = table.number("start", 0.0, not_negative);
    if (table.has("end")) remove.end = table.number("end", std::nullopt, not_negative);
    remove.every = static_cast<int>(table.integer("every", remove.every, 1, 1'000'000));
    table.finish();
    c.removes.push_back(std::move(remove));
  }
}

}  // namespace cairn::reading
