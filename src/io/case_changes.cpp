#include "cairn/io/case_changes.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <map>
#include <sstream>
#include <string_view>

#include "cairn/core/error.hpp"
#include "cairn/io/checksum.hpp"
#include "case_reader.hpp"

namespace cairn {

namespace {

using Values = std::map<std::string, std::string>;

std::string text_of(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  if (const auto* array = node.as_array()) {
    std::string text;
    for (const auto& entry : *array) text += (text.empty() ? "" : ", ") + text_of(entry);
    return "[" + text + "]";
  }
  std::ostringstream stream;
  node.visit([&](const auto& value) { stream << toml::toml_formatter{value}; });
  return stream.str();
}

/// Lists the plain values below a node by their dotted paths.
void flatten(const toml::node& node, const std::string& path, Values& values) {
  const auto inner = [&](const auto& part) {
    return path.empty() ? fmt::format("{}", part) : fmt::format("{}.{}", path, part);
  };
  if (const auto* table = node.as_table()) {
    for (const auto& [key, value] : *table) flatten(value, inner(key.str()), values);
  } else if (const auto* array = node.as_array(); array && array->is_array_of_tables()) {
    for (std::size_t i = 0; i < array->size(); ++i) flatten(*array->get(i), inner(i), values);
  } else {
    values[path] = text_of(node);
  }
}

Values values_of(const std::string& text) {
  Values values;
  flatten(reading::parse_text(text, "the case in the checkpoint"), "", values);
  return values;
}

/// Adds every number of a shape.
struct ShapeSum {
  Checksum& sum;
  void add(double value) const { sum.add_values(std::span<const double>(&value, 1)); }
  void add(const Vec3& v) const { sum.add_values(std::span<const double>(v.data(), 3)); }
  void add(const std::string& text) const { sum.add_values(std::span(text.data(), text.size())); }
  void vector(std::string_view, const Vec3& v) const { add(v); }
  void positive(std::string_view, const Vec3& v) const { add(v); }
  void positive(std::string_view, double value) const { add(value); }
  void not_negative(std::string_view, double value) const { add(value); }
  void angle(std::string_view, double value) const { add(value); }
  void vectors(std::string_view, const std::vector<Vec3>& list) const {
    for (const Vec3& p : list) add(p);
  }
  void text(std::string_view, const std::string& value) const { add(value); }
  void file(std::string_view, const ShapeFile& file) const { plain(file.checksum); }
  void placement(const Placement& p) const { add(p.factor()), add(p.move), add(p.rotate); }
  void plain(const Vec3& v) const { add(v); }
  template <class T>
  void plain(T value) const {
    sum.add_values(std::span<const T>(&value, 1));
  }
  void all(const Shape& shape) const {
    add(static_cast<double>(shape.index()));
    std::visit(
        [&]<class S>(const S& s) {
          if constexpr (std::is_same_v<S, Compound>) {
            add(static_cast<double>(s.operation)), add(static_cast<double>(s.of.size()));
            for (const Shape& part : s.of) all(part);
          } else {
            S::list(s, *this);
          }
        },
        shape);
  }
};

}  // namespace

std::vector<KeyChange> case_changes(const std::string& before, const std::string& after) {
  const Values a = values_of(before), b = values_of(after);
  constexpr const char* none = "(none)";
  std::vector<KeyChange> changes;
  for (const auto& [key, value] : a) {
    const auto other = b.find(key);
    if (other == b.end() || other->second != value)
      changes.push_back({key, value, other == b.end() ? none : other->second});
  }
  for (const auto& [key, value] : b)
    if (!a.contains(key)) changes.push_back({key, none, value});
  std::ranges::sort(changes, {}, &KeyChange::key);
  return changes;
}

Freedom freedom_of(const std::string& key) {
  const auto starts = [&](std::string_view start) { return key.starts_with(start); };
  for (const char* fixed :
       {"domain.dimension", "domain.lower", "domain.upper", "domain.cells", "domain.periodic", "domain.patch_cells"})
    if (key == fixed) return Freedom::fixed;
  if (starts("materials.") && key.ends_with(".model")) return Freedom::fixed;  // the state variables are the model's
  for (const char* free :
       {"title", "time.end", "time.steps", "time.wall_limit", "solver.energy_limit", "solver.lost_points"})
    if (key == free) return Freedom::free;
  if (starts("output.") || starts("parallel.")) return Freedom::free;
  // A file may have moved: whether its content is the same, bodies_checksum says.
  for (const char* from : {"grains.", "labels.", "bodies."})
    if (starts(from) && key.ends_with(".file")) return Freedom::free;
  return Freedom::on_demand;
}

std::uint64_t bodies_checksum(const Case& c) {
  Checksum sum;
  const ShapeSum add{sum};
  for (const auto& body : c.bodies) {
    add.all(body.shape);
    add.add(static_cast<double>(body.material));
    add.add(body.velocity), add.add(body.angular_velocity);
    if (body.initial_pressure != 0) add.add(body.initial_pressure);
    add.add(static_cast<double>(body.group.size()));
    sum.add_values(std::span(body.group.data(), body.group.size()));
  }
  return sum.value();
}

}  // namespace cairn
