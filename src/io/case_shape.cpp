// The shapes of bodies.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "case_names.hpp"
#include "shape_files.hpp"

namespace cairn::reading {
namespace {

/// Reads the keys of a shape.
struct KeyReader {
  Table& table;
  int dim;
  void vector(std::string_view key, Vec3& v) { v = table.vector(key, dim, std::nullopt); }
  void vectors(std::string_view key, std::vector<Vec3>& list) { list = table.vectors(key, dim); }
  void positive(std::string_view key, Vec3& v) { v = table.vector(key, dim, std::nullopt, reading::positive); }
  void positive(std::string_view key, double& value) { value = table.number(key, std::nullopt, reading::positive); }
  void not_negative(std::string_view key, double& value) { value = table.number(key, value, reading::not_negative); }
  void angle(std::string_view key, double& value) { value = table.number(key, 0.0); }
  void text(std::string_view key, std::string& value) { value = table.text(key, value); }
  void file(std::string_view key, ShapeFile& f) { f.name = table.text(key, std::nullopt); }
  void placement(Placement& p) { p = read_placement(table, dim); }
};

template <class S>
std::optional<Shape> read(Table& table, Draft& draft) {
  const std::size_t before = table.error_count();
  const int dim = draft.result.domain.dimension;
  S shape{};
  KeyReader keys{table, dim};
  S::list(shape, keys);
  if constexpr (requires { shape.problem(dim); }) {
    if (table.error_count() == before)
      if (const auto problem = shape.problem(dim)) table.error(problem->key, problem->text);
  }
  if constexpr (requires { load(shape, table, draft); }) {
    if (table.error_count() == before) load(shape, table, draft);
  }
  if (table.error_count() != before) return std::nullopt;
  return shape;
}

std::optional<Shape> read_compound(Table& t, CompoundOperation operation, Draft& draft, Errors& errors) {
  Compound compound{operation, {}};
  const std::size_t least = operation == CompoundOperation::union_of ? 1 : 2;
  auto parts = t.tables("of");
  if (!t.has("of")) t.missing("of", "is missing; it must be an array of shapes");
  if (t.has("of") && parts.size() < least)
    t.error("of", fmt::format("holds {} shapes; this operation needs at least {}", parts.size(), least));
  for (Table& part : parts)
    if (auto shape = read_shape(part, draft, errors)) {
      if (is_several(*shape)) part.error("file", "stands for each of its parts, which a compound cannot; name one");
      compound.of.push_back(std::move(*shape));
    }
  return compound;
}

struct ShapeKind {
  std::string_view name;
  std::optional<Shape> (*read)(Table&, Draft&);
};

/// Those of the dimension, in the order of the variant.
template <class... S>
std::vector<ShapeKind> kinds_of(const std::variant<S...>*, int dimension) {
  std::vector<ShapeKind> kinds;
  const auto add = [&]<class One>(const One*) {
    if constexpr (requires { One::names; } && !std::is_same_v<One, LabelBody>)
      if (!One::names.of(dimension).empty()) kinds.push_back({One::names.of(dimension), read<One>});
  };
  (add(static_cast<const S*>(nullptr)), ...);
  return kinds;
}

}  // namespace

Placement read_placement(Table& table, int dimension) {
  Placement p;
  std::vector<std::string_view> units;
  for (const LengthUnit& unit : length_units) units.push_back(unit.name);
  if (!table.has("unit") && !table.has("scale"))
    table.missing("unit", "is missing; say in what unit the file's lengths are, one of " + listed(units) +
                              ", or give scale, in metres");
  if (const std::size_t i = table.choose("unit", units); i < units.size()) p.unit = units[i];
  p.scale = table.number("scale", 1.0, positive);
  p.move = table.vector("move", dimension, Vec3::Zero().eval());
  if (dimension == 3)
    p.rotate = table.vector("rotate", 3, Vec3::Zero().eval());
  else
    p.rotate.z() = table.number("rotate", 0.0);
  return p;
}

std::optional<Shape> read_shape(Table table, Draft& draft, Errors& errors) {
  const std::size_t before = errors.count();
  const std::vector<ShapeKind> kinds = kinds_of(static_cast<const Shape*>(nullptr), draft.result.domain.dimension);
  std::vector<std::string_view> names;
  for (const auto& kind : kinds) names.push_back(kind.name);
  for (const auto& compound : compound_names) names.push_back(compound.name);

  if (!table.has("type")) table.missing("type", "is missing; choose one of " + listed(names));
  const std::size_t choice = table.choose("type", names);
  if (choice >= names.size()) return std::nullopt;
  std::optional<Shape> shape;
  if (choice >= kinds.size())
    shape = read_compound(table, compound_names[choice - kinds.size()].value, draft, errors);
  else
    shape = kinds[choice].read(table, draft);
  table.finish();
  if (errors.count() != before) shape.reset();
  return shape;
}

}  // namespace cairn::reading
