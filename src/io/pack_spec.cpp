#include "cairn/io/pack_spec.hpp"

#include <algorithm>

#include "cairn/core/error.hpp"
#include "case_reader.hpp"

namespace cairn {
namespace {

using namespace reading;

constexpr Named<SizeType> size_type_names[] = {{"uniform", SizeType::uniform},
                                               {"lognormal", SizeType::lognormal},
                                               {"list", SizeType::list},
                                               {"fit", SizeType::fit}};
constexpr Named<PackWalls> wall_names[] = {{"inside", PackWalls::inside}, {"overlap", PackWalls::overlap}};

/// Keys of [sizes] that hold one number, and the types of distribution that take them.
struct SizeKey {
  std::string_view key;
  double SizeSpec::*member;
  std::vector<SizeType> required, optional;
};

void read_sizes(Table table, SizeSpec& sizes) {
  static const SizeKey keys[] = {{"min", &SizeSpec::min, {SizeType::uniform, SizeType::fit}, {SizeType::lognormal}},
                                 {"max", &SizeSpec::max, {SizeType::uniform, SizeType::fit}, {SizeType::lognormal}},
                                 {"mean", &SizeSpec::mean, {SizeType::lognormal, SizeType::fit}, {}},
                                 {"sigma", &SizeSpec::sigma, {SizeType::lognormal}, {}}};
  if (!table.present()) return table.missing("", "the table is missing; it needs at least type");
  sizes.type = table.choice("type", size_type_names, std::nullopt);
  for (const auto& entry : keys) {
    const bool required = std::ranges::find(entry.required, sizes.type) != entry.required.end();
    const bool optional = std::ranges::find(entry.optional, sizes.type) != entry.optional.end();
    if (table.has(entry.key) || required) sizes.*entry.member = table.number(entry.key, std::nullopt, positive);
    if (table.has(entry.key) && !required && !optional)
      table.error(entry.key,
                  "does not belong to type \"" + std::string(name_of(size_type_names, sizes.type)) + "\"; remove it");
  }
  const bool listed = sizes.type == SizeType::list;
  if (listed && !table.has("diameters"))
    table.missing("diameters", "is missing; it must be an array of numbers greater than 0");
  sizes.diameters = table.numbers("diameters", positive);
  sizes.weights = table.numbers("weights", not_negative);
  for (const std::string_view key : {"diameters", "weights"})
    if (table.has(key) && !listed) table.error(key, "belongs to type \"list\" only; remove it");
  sizes.scale = table.boolean("scale", false);
  table.finish();
}

/// Where the key is written that a line of `check_pack` begins with.
Location location_of_line(std::string_view line, const Table& pack, const Table& sizes) {
  const std::string_view path = line.substr(0, line.find_first_of(" ,:="));
  const std::string_view key = path.substr(std::min(path.size(), path.find('.') + 1));
  return path.starts_with("sizes") ? sizes.where(key) : pack.where(key);
}

}  // namespace

PackSpec read_pack_spec(const std::filesystem::path& file) {
  const toml::table tree = parse_file(file, "a pack specification (TOML)");
  Errors errors(file.string());
  Table root(&tree, "", {file.string(), 1}, errors);
  PackSpec spec;
  Table pack = root.table("pack");
  if (pack.present()) {
    spec.dimension = static_cast<int>(pack.integer("dimension", 2, 2, 3));
    spec.lower = pack.vector("lower", spec.dimension, Vec3::Zero().eval());
    spec.upper = pack.vector("upper", spec.dimension, std::nullopt);
    spec.periodic = pack.booleans("periodic", spec.dimension);
    spec.walls = pack.choice("walls", wall_names, PackWalls::inside);
    spec.count = pack.has("count") ? static_cast<int>(pack.integer("count", std::nullopt, 1, 100'000'000)) : 0;
    spec.fraction = pack.has("fraction") ? pack.number("fraction", std::nullopt, {0, 1, true, true}) : 0;
    spec.seed = static_cast<std::uint64_t>(pack.integer("seed", 1, 0, std::numeric_limits<std::int64_t>::max()));
    spec.max_overlap = pack.number("max_overlap", spec.max_overlap, {0, 0.1, true, true});
    spec.effort = pack.number("effort", spec.effort, {0, 1000, true});
    if (!pack.has("count") && !pack.has("fraction")) pack.missing("count", "is missing; give count, fraction, or both");
    pack.finish();
  } else {
    pack.missing("", "the table is missing; it needs at least upper and count or fraction");
  }
  const Table sizes = root.table("sizes");
  read_sizes(sizes, spec.sizes);
  root.finish();
  if (errors.count() == 0)
    for (const auto& line : check_pack(spec)) errors.add(location_of_line(line, pack, sizes), "", line);
  errors.throw_if_any();
  return spec;
}

}  // namespace cairn
