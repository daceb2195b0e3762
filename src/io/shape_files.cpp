#include "shape_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "cairn/core/error.hpp"
#include "cairn/io/checksum.hpp"

namespace cairn::reading {
namespace {

std::string near(const Vec3& x) { return fmt::format("near [{:.6g}, {:.6g}, {:.6g}]", x.x(), x.y(), x.z()); }

/// Reads the file that a shape names and notes its copy; nothing after an error.
std::optional<std::string> read_file(ShapeFile& file, std::string_view what, Table& table, Draft& draft) {
  try {
    const std::filesystem::path path = path_of_file(file.name, table, draft);
    if (path.empty()) return std::nullopt;
    std::string bytes = read_bytes(path, what);
    file.checksum = checksum(std::span<const char>(bytes));
    file.copy = add_copy(draft.result.tables, path, file.checksum);
    return bytes;
  } catch (const InputError& error) {
    table.error("file", error.what());
    return std::nullopt;
  }
}

/// Reports what is wrong with a solid, and warns of what was mended.
void report(const SurfaceFaults& faults, const std::string& which, const Mesh& mesh, Table& table, Draft& draft) {
  const double factor = mesh.placement.factor();
  if (faults.open_edges > 0 && !(factor * faults.largest_hole <= mesh.holes))
    table.error("file",
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

std::string name_of(const SolidPart& part, std::size_t number) {
  return part.name.empty() ? fmt::format("solid {}", number)
                           : fmt::format("solid {} ({})", in_quotes(part.name), part.place);
}

/// Those that the shape asks for.
std::vector<std::size_t> chosen(const std::vector<SolidPart>& parts, const Mesh& mesh, Table& table) {
  std::vector<std::size_t> all, named;
  std::string names;
  std::size_t number = parts.size();
  std::from_chars(mesh.solid.data(), mesh.solid.data() + mesh.solid.size(), number);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    all.push_back(i);
    if (parts[i].name == mesh.solid) named.push_back(i);
    if (i < 10) names += fmt::format("{}{} {}", i ? ", " : "", i, in_quotes(parts[i].name));
  }
  if (mesh.solid.empty()) return all;
  if (named.empty() && number < parts.size()) return {number};
  if (named.empty())
    table.error("solid", fmt::format("{} is no solid of the file; it holds {}", in_quotes(mesh.solid), names));
  return named;
}

std::shared_ptr<const Solid> make_solid(std::string_view bytes, const Mesh& mesh, Table& table, Draft& draft) {
  std::vector<SolidPart> parts = read_solids(bytes);
  const std::size_t before = table.error_count();
  Triangles all;
  bool closed = true;
  for (const std::size_t i : chosen(parts, mesh, table)) {
    Triangles& part = parts[i].triangles;
    if (part.corners.empty()) {
      table.error("file", fmt::format("{} holds no triangles", name_of(parts[i], i)));
      continue;
    }
    const SurfaceFaults faults = mend(part);
    if (part.corners.empty()) {
      table.error("file", fmt::format("{} holds no triangle with an area", name_of(parts[i], i)));
      continue;
    }
    report(faults, name_of(parts[i], i), mesh, table, draft);
    closed = closed && faults.open_edges == 0;
    const auto first = static_cast<std::int32_t>(all.points.size());
    all.points.insert(all.points.end(), part.points.begin(), part.points.end());
    for (const auto& c : part.corners) all.corners.push_back({first + c[0], first + c[1], first + c[2]});
    part = {};
  }
  if (table.error_count() != before) return nullptr;
  if (all.corners.empty()) {
    table.error("file", "holds no solid");
    return nullptr;
  }
  auto solid = std::make_shared<Solid>(std::move(all), closed);
  if (!(solid->volume() > 0)) {
    table.error("file", fmt::format("encloses a volume of {:.3g}; it must be above 0", solid->volume()));
    return nullptr;
  }
  return solid;
}

}  // namespace

void load(Mesh& mesh, Table& table, Draft& draft) {
  const auto bytes = read_file(mesh.file, "a surface (STL, OBJ or PLY)", table, draft);
  if (!bytes) return;
  const std::string key = fmt::format("{:x} {} {} {}", mesh.file.checksum, mesh.holes > 0, mesh.placement.factor(), mesh.solid);
  try {
    auto& known = draft.solids[key];
    if (!known) known = make_solid(*bytes, mesh, table, draft);
    mesh.inside = known;
  } catch (const InputError& error) {
    table.error("file", mesh.file.name + error.what());
  }
  if (!mesh.inside) return;
  mesh.place = Place(mesh.placement);
  mesh.box = shapes::nothing();
  for (const Vec3& x : mesh.inside->points()) shapes::widen(mesh.box, mesh.place.in_space(x));
}

void load(Outline& outline, Table& table, Draft& draft) {
  const auto bytes = read_file(outline.file, "an outline (CSV, SVG or DXF)", table, draft);
  if (!bytes) return;
  try {
    const auto lines = read_lines(*bytes);
    auto loops = std::make_shared<Loops>(lines);
    if (loops->edges().empty()) return table.error("file", "holds no closed line");
    if (const auto crossing = crossing_edges(loops->edges()))
      return table.error("file", fmt::format("the edges that begin {} and {} cross or touch each other",
                                             near(loops->edges()[crossing->first].from),
                                             near(loops->edges()[crossing->second].from)));
    if (!(loops->area() > 0)) return table.error("file", "its lines enclose no area");
    outline.loops = std::move(loops);
  } catch (const InputError& error) {
    return table.error("file", outline.file.name + error.what());
  }
  outline.place = Place(outline.placement);
  outline.box = shapes::nothing();
  for (const auto& edge : outline.loops->edges()) shapes::widen(outline.box, outline.place.in_space(edge.from));
}

}  // namespace cairn::reading
