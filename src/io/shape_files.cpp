#include "shape_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "cairn/core/error.hpp"
#include "cairn/io/checksum.hpp"

namespace cairn::reading {
namespace {

constexpr const char* each = "each";

std::string near(const Vec3& x) { return fmt::format("near [{:.6g}, {:.6g}, {:.6g}]", x.x(), x.y(), x.z()); }

/// What `read` makes of the file that a shape names, read once for all shapes; notes its copy. Nothing after an error.
template <class T>
std::shared_ptr<const T> contents_of(ShapeFile& file, std::map<std::string, FileParts<T>>& known,
                                     T (*read)(std::string_view), std::string_view what, Table& table, Draft& draft) {
  std::string name;
  try {
    const std::filesystem::path path = path_of_file(file.name, table, draft);
    if (path.empty()) return nullptr;
    FileParts<T>& parts = known[path.string()];
    if (!parts.content) {
      const std::string bytes = read_bytes(path, what);
      name = path.string();
      parts = {std::make_shared<const T>(read(bytes)), checksum(std::span<const char>(bytes))};
    }
    file.checksum = parts.checksum;
    file.copy = add_copy(draft.result.tables, path, file.checksum);
    return parts.content;
  } catch (const InputError& error) {
    table.error("file", name + error.what());
    return nullptr;
  }
}

/// Reports what is wrong with a solid, and warns of what was mended.
void report(const SurfaceFaults& faults, const std::string& which, const Mesh& mesh, Table& table, Draft& draft) {
  const double factor = mesh.placement.factor();
  if (faults.open_edges > 0 && !(factor * faults.largest_hole <= mesh.holes))
    table.error(
        "file",
        fmt::format("{} has {} open edges, the first {}: it is not closed, and what lies inside is not told; close "
                    "it, or allow holes of that size: holes = {:.3g} (in m, the largest is so wide)",
                    which, faults.open_edges, near(faults.open_at), 1.001 * factor * faults.largest_hole));
  const auto warn = [&](std::int64_t count, const Vec3& where, std::string_view text) {
    if (count > 0)
      draft.result.warnings.push_back(
          fmt::format("{}: {}: {} {}; the first {}", table.where("file").text(), which, count, text, near(where)));
  };
  if (faults.open_edges > 0 && factor * faults.largest_hole <= mesh.holes)
    warn(faults.open_edges, faults.open_at, "open edges, whose holes are closed");
  warn(faults.flipped, faults.flipped_at, "triangles are turned against their neighbours; they were turned back");
  warn(faults.repeated, faults.repeated_at, "triangles are there twice; they count once");
  warn(faults.shared_edges, faults.shared_at, "edges belong to more than two triangles");
  warn(faults.crossings, faults.crossing_at, "pairs of triangles pass through each other; parts that overlap are one");
  if (faults.inside_out)
    draft.result.warnings.push_back(
        fmt::format("{}: {}: its normals point inwards; it was turned", table.where("file").text(), which));
}

std::string name_of(const std::string& file, const SolidPart& part, std::size_t number) {
  return part.name.empty() ? fmt::format("{}: solid #{}", file, number)
                           : fmt::format("{}: solid {} ({})", file, in_quotes(part.name), part.place);
}

/// Those of `names` that are asked for: all, the ones of this name, or "#N", the one with this number.
std::vector<std::size_t> chosen(const std::vector<std::string>& names, const std::string& wanted, std::string_view key,
                                Table& table) {
  std::vector<std::size_t> found;
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (wanted.empty() || names[i] == wanted || wanted == fmt::format("#{}", i)) found.push_back(i);
    if (i < 10) list += fmt::format("{}#{} {}", i ? ", " : "", i, in_quotes(names[i]));
  }
  if (found.empty() && !wanted.empty())
    table.error(key, fmt::format("{} is not in the file; it holds {}{}", in_quotes(wanted), list,
                                 names.size() > 10 ? ", ..." : ""));
  return found;
}

std::vector<std::string> names_of(const auto& parts) {
  std::vector<std::string> names;
  for (const auto& part : parts) names.push_back(part.name);
  return names;
}

std::shared_ptr<const Solid> make_solid(const std::vector<SolidPart>& parts, const Mesh& mesh, Table& table,
                                        Draft& draft) {
  const std::size_t before = table.error_count();
  Triangles all;
  bool closed = true;
  for (const std::size_t i : chosen(names_of(parts), mesh.solid, "solid", table)) {
    Triangles part = parts[i].triangles;
    if (part.corners.empty()) {
      table.error("file", fmt::format("{} holds no triangles", name_of(mesh.file.name, parts[i], i)));
      continue;
    }
    const SurfaceFaults faults = mend(part);
    if (part.corners.empty()) {
      table.error("file", fmt::format("{} holds no triangle with an area", name_of(mesh.file.name, parts[i], i)));
      continue;
    }
    report(faults, name_of(mesh.file.name, parts[i], i), mesh, table, draft);
    closed = closed && faults.open_edges == 0;
    const auto first = static_cast<std::int32_t>(all.points.size());
    all.points.insert(all.points.end(), part.points.begin(), part.points.end());
    for (const auto& c : part.corners) all.corners.push_back({first + c[0], first + c[1], first + c[2]});
  }
  if (table.error_count() != before) return nullptr;
  if (all.corners.empty()) {
    table.error("file", mesh.file.name + " holds no solid");
    return nullptr;
  }
  auto solid = std::make_shared<Solid>(std::move(all), closed);
  if (!(solid->volume() > 0)) {
    table.error("file",
                fmt::format("{} encloses a volume of {:.3g}; it must be above 0", mesh.file.name, solid->volume()));
    return nullptr;
  }
  return solid;
}

}  // namespace

void load(Mesh& mesh, Table& table, Draft& draft) {
  const auto parts = contents_of(mesh.file, draft.surfaces, read_solids, "a surface (STL, OBJ or PLY)", table, draft);
  if (!parts) return;
  if (mesh.solid == each) {
    mesh.count = parts->size();
    return;
  }
  auto& known =
      draft.solids[fmt::format("{:x} {} {} {}", mesh.file.checksum, mesh.holes, mesh.placement.factor(), mesh.solid)];
  if (!known) known = make_solid(*parts, mesh, table, draft);
  mesh.inside = known;
  if (!mesh.inside) return;
  mesh.place = Place(mesh.placement);
  mesh.box = shapes::nothing();
  for (const Vec3& x : mesh.inside->points()) shapes::widen(mesh.box, mesh.place.in_space(x));
}

void load(Outline& outline, Table& table, Draft& draft) {
  const std::size_t before = table.error_count();
  const auto parts =
      contents_of(outline.file, draft.outlines, read_lines, "an outline (CSV, SVG or DXF)", table, draft);
  if (!parts) return;
  if (outline.line == each) {
    outline.count = parts->size();
    return;
  }
  std::vector<std::vector<Vec3>> lines;
  for (const std::size_t i : chosen(names_of(*parts), outline.line, "line", table)) lines.push_back((*parts)[i].points);
  if (table.error_count() != before) return;
  auto loops = std::make_shared<Loops>(lines);
  if (loops->edges().empty()) return table.error("file", outline.file.name + " holds no closed line");
  if (const auto crossing = crossing_edges(loops->edges()))
    return table.error(
        "file", fmt::format("{}: the edges that begin {} and {} cross or touch each other", outline.file.name,
                            near(loops->edges()[crossing->first].from), near(loops->edges()[crossing->second].from)));
  if (!(loops->area() > 0)) return table.error("file", outline.file.name + ": its lines enclose no area");
  outline.loops = std::move(loops);
  outline.place = Place(outline.placement);
  outline.box = shapes::nothing();
  for (const auto& edge : outline.loops->edges()) shapes::widen(outline.box, outline.place.in_space(edge.from));
}

bool is_several(const Shape& shape) {
  const auto* mesh = std::get_if<Mesh>(&shape);
  const auto* outline = std::get_if<Outline>(&shape);
  return (mesh && mesh->solid == each) || (outline && outline->line == each);
}

std::vector<Shape> one_by_one(const Shape& shape, Table& table, Draft& draft) {
  std::vector<Shape> shapes;
  const auto expand = [&](auto one, auto which) {
    const std::size_t count = std::exchange(one.count, 0);
    for (std::size_t i = 0; i < count; ++i) {
      one.*which = fmt::format("#{}", i);
      load(one, table, draft);
      shapes.emplace_back(one);
    }
  };
  if (!is_several(shape))
    shapes.push_back(shape);
  else if (const auto* mesh = std::get_if<Mesh>(&shape))
    expand(*mesh, &Mesh::solid);
  else
    expand(std::get<Outline>(shape), &Outline::line);
  return shapes;
}

}  // namespace cairn::reading
