// Keys of [[cracks]] for surfaces, in 3D.

#include <fmt/format.h>

#include "cairn/core/error.hpp"
#include "cairn/crack/triangles.hpp"
#include "cairn/io/checksum.hpp"
#include "case_sections.hpp"
#include "shape_files.hpp"

namespace cairn::reading {
namespace {

std::string text_of(const Vec3& x) { return fmt::format("{:.6g}, {:.6g}, {:.6g} m", x.x(), x.y(), x.z()); }

void read_disk(Table table, CrackSpec& crack) {
  CrackDisk disk;
  disk.centre = table.vector("centre", 3, std::nullopt), disk.normal = table.vector("normal", 3, std::nullopt);
  disk.radius = table.number("radius", std::nullopt, positive);
  if (!(disk.normal.norm() > 0)) table.error("normal", "must not be zero; it points to what is above the crack");
  table.finish();
  crack.disk = disk;
}

void read_rectangle(Table table, CrackSpec& crack) {
  const Vec3 corner = table.vector("corner", 3, std::nullopt);
  const auto edges = table.vectors("edges", 3);
  if (edges.size() != 2 || !(edges[0].cross(edges[1]).norm() > 1e-12 * edges[0].norm() * edges[1].norm()))
    table.error("edges",
                "must hold two vectors [m] that are not parallel; above is where the first x the second "
                "points to");
  else
    crack.points = {corner, corner + edges[1]}, crack.extrude = edges[0];
  table.finish();
}

void read_file(Table& table, CrackSpec& crack, Draft& draft) {
  CrackFile file;
  file.scale = table.number("scale", 1.0, positive);
  const std::filesystem::path path = path_of_file(table.text("triangles", std::nullopt), table, draft, "triangles");
  if (path.empty()) return;
  try {
    const std::string bytes = read_bytes(path, "a surface (STL, OBJ or PLY)");
    for (const SolidPart& part : read_solids(bytes)) {
      const auto first = static_cast<std::int32_t>(file.triangles.points.size());
      for (const Vec3& x : part.triangles.points) file.triangles.points.push_back(file.scale * x);
      for (const auto& c : part.triangles.corners)
        file.triangles.corners.push_back({first + c[0], first + c[1], first + c[2]});
    }
    file.name = add_copy(draft.result.tables, path, checksum(std::span<const char>(bytes)));
  } catch (const InputError& error) {
    return table.error("triangles", path.string() + error.what());
  }
  const SurfaceFaults faults = mend_sheet(file.triangles);
  if (faults.flipped > 0)
    draft.result.warnings.push_back(fmt::format(
        "{}: {}: {} triangles are turned against their neighbours; they were turned back; the first near {}",
        table.where("triangles").text(), path.string(), faults.flipped, text_of(faults.flipped_at)));
  if (const std::string problem = problem_of_surface(file.triangles); !problem.empty())
    return table.error("triangles", path.string() + " " + problem);
  crack.file = std::move(file);
}

/// Points drawn out.
void read_sheet(Table& table, CrackSpec& crack) {
  crack.points = table.vectors("points", 3);
  if (!table.has("extrude"))
    return table.missing("extrude", "is missing; in 3D the line of `points` is drawn out along a vector [m]");
  crack.extrude = table.vector("extrude", 3, std::nullopt);
  for (std::size_t i = 1; i < crack.points.size(); ++i)
    if (!((crack.points[i] - crack.points[i - 1]).cross(crack.extrude).norm() > 0))
      return table.error("extrude", fmt::format("is parallel to the line from point {} to point {}", i - 1, i));
}

}  // namespace

void read_crack_surface(Table& table, CrackSpec& crack, Draft& draft) {
  int given = 0;
  for (const auto* key : {"points", "rectangle", "disk", "triangles"}) given += table.has(key);
  if (given != 1)
    return table.error("",
                       "needs one of `points` with `extrude`, `rectangle`, `disk` and `triangles`: a crack is a "
                       "surface in 3D");
  for (const auto* key : {"ends", "grains"})
    if (table.has(key)) table.error(key, "is for 2D; in 3D the rim is a tip where it lies inside a body, else open");
  if (table.has("extrude") && !table.has("points")) table.error("extrude", "is only for `points`");
  if (table.has("scale") && !table.has("triangles")) table.error("scale", "is only for `triangles`");
  if (table.has("points")) read_sheet(table, crack);
  if (table.has("rectangle")) read_rectangle(table.table("rectangle"), crack);
  if (table.has("disk")) read_disk(table.table("disk"), crack);
  if (table.has("triangles")) read_file(table, crack, draft);
}

void check_crack_surface(Table& table, const Case& c, CrackSpec& crack) {
  const auto inside = [&](const Vec3& x) {
    return std::ranges::any_of(c.bodies, [&](const BodySpec& body) {
      return crack.cuts(static_cast<int>(&body - c.bodies.data()), body.group) && contains(body.shape, x);
    });
  };
  const double spacing = smallest_cell(c.domain);
  try {
    const Triangles surface = crack_surface(crack, spacing);
    for (const Vec3& x : surface.points)
      for (int k = 0; k < 3; ++k)
        if (!(x[k] >= c.domain.lower[k] && x[k] <= c.domain.upper[k]))
          return table.error("", fmt::format("the crack lies outside the domain, at {}", text_of(x)));
    if (std::ranges::none_of(surface.points, inside))
      return table.error("", "the crack lies in no body that it cuts; move it, or see `bodies` and `ids`");
    const auto held = hold_surface(surface, spacing, inside);
    const bool has_tip = std::ranges::any_of(held, [](const auto& point) { return point.tip; });
    crack.ends = {CrackEnd::open, has_tip ? CrackEnd::tip : CrackEnd::open};
    if (!has_tip && crack.growth.criterion != GrowthCriterion::none)
      table.error("growth", "needs a rim inside a body, and all of the crack's is open");
  } catch (const InputError& error) {
    table.error("", error.what());
  }
}

}  // namespace cairn::reading
