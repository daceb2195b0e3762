// [[cracks]] and [crack].

#include <fmt/format.h>

#include <algorithm>

#include "case_names.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

/// Whether x lies in a body that the crack may cut.
bool in_cut_body(const Case& c, const CrackSpec& crack, const Vec3& x) {
  return std::ranges::any_of(c.bodies, [&](const BodySpec& body) {
    return crack.cuts(static_cast<int>(&body - c.bodies.data()), body.group) && contains(body.shape, x);
  });
}

double cell_of(const Domain& d) {
  double h = infinity;
  for (int k = 0; k < d.dimension; ++k) h = std::min(h, (d.upper[k] - d.lower[k]) / d.cells[k]);
  return h;
}

/// Tips lie in a body, and open ends at or beyond its surface.
void check_end(Table& table, const Case& c, const CrackSpec& crack, int end) {
  const auto n = crack.points.size();
  const Vec3& x = end == 0 ? crack.points[0] : crack.points[n - 1];
  const Vec3& before = end == 0 ? crack.points[1] : crack.points[n - 2];
  const std::string where = fmt::format("the {} end, at {:.6g}, {:.6g} m,", end == 0 ? "first" : "last", x.x(), x.y());
  if (crack.ends[end] == CrackEnd::tip && !in_cut_body(c, crack, x))
    return table.error("ends", where + " is a tip and lies in no body that the crack cuts; move it, or call it open");
  const Vec3 beyond = x + 0.51 * cell_of(c.domain) * (x - before).normalized();
  if (crack.ends[end] == CrackEnd::open && in_cut_body(c, crack, beyond))
    table.error("ends", where + " is open and lies inside a body; move it to the surface, or call it a tip");
}

void check_points_of(Table& table, const Domain& domain, const CrackSpec& crack) {
  if (crack.points.size() < 2)
    return table.error("points", fmt::format("holds {} points; a crack needs at least 2", crack.points.size()));
  for (std::size_t i = 0; i < crack.points.size(); ++i) {
    const Vec3& x = crack.points[i];
    for (int k = 0; k < domain.dimension; ++k)
      if (!(x[k] >= domain.lower[k] && x[k] <= domain.upper[k]))
        return table.error("points",
                           fmt::format("point {}, at {:.6g}, {:.6g} m, lies outside the domain", i, x.x(), x.y()));
    if (i > 0 && (x - crack.points[i - 1]).norm() < 1e-3 * cell_of(domain))
      return table.error("points", fmt::format("points {} and {} are the same; give each once", i - 1, i));
  }
}

/// The bodies that a crack cuts.
void read_cut_bodies(Table& table, CrackSpec& crack, const Draft& draft) {
  if (table.has("bodies")) crack.groups = table.texts("bodies");
  if (table.has("ids")) crack.ids = table.integers("ids"), check_ids(table, "ids", crack.ids, draft);
  for (const auto& group : crack.groups)
    if (draft.bodies_known &&
        std::ranges::none_of(draft.result.bodies, [&](const auto& b) { return b.group == group; }))
      table.error("bodies", fmt::format("no body has the group {}", in_quotes(group)));
}

/// In 3D.
void read_surface(Table table, Draft& draft) {
  CrackSpec crack;
  crack.source = table.where().text();
  const std::size_t before = table.error_count();
  read_crack_surface(table, crack, draft);
  read_cut_bodies(table, crack, draft);
  read_crack_law(table, crack);
  table.finish();
  if (table.error_count() == before && draft.domain_known && draft.bodies_known)
    check_crack_surface(table, draft.result, crack);
  draft.result.cracks.push_back(std::move(crack));
}

void read_crack(Table table, Draft& draft) {
  Case& c = draft.result;
  CrackSpec crack;
  crack.source = table.where().text();
  const std::size_t before = table.error_count();
  const bool in_grains = table.has("grains");
  if (!table.has("points") && !in_grains)
    table.missing("points", "is missing; list the points of the crack's line, or give `grains`");
  for (const auto* key : {"points", "ends", "ids"})
    if (in_grains && table.has(key)) table.error(key, "is found for each grain where `grains` is given; remove it");
  if (table.has("points")) crack.points = table.vectors("points", 2);
  read_cut_bodies(table, crack, draft);
  if (table.has("ends")) {
    const auto names = table.texts("ends");
    if (names.size() != 2) table.error("ends", "names the two ends; give two of \"open\" and \"tip\"");
    for (std::size_t i = 0; i < std::min<std::size_t>(2, names.size()); ++i) {
      const auto* found = std::ranges::find(crack_end_names, names[i], &Named<CrackEnd>::name);
      if (found == std::end(crack_end_names))
        table.error("ends", fmt::format("{} is not a choice; choose from open, tip", in_quotes(names[i])));
      else
        crack.ends[i] = found->value;
    }
  }
  if (in_grains) {
    crack.ends = {CrackEnd::tip, CrackEnd::tip};  // some of them
    read_crack_law(table, crack);
    if (table.error_count() == before) read_grain_cracks(table.table("grains"), crack, draft);
    return table.finish();
  }
  read_crack_law(table, crack);
  table.finish();
  if (table.error_count() == before && draft.domain_known) check_points_of(table, c.domain, crack);
  if (table.error_count() == before && draft.bodies_known)
    for (const int end : {0, 1}) check_end(table, c, crack, end);
  c.cracks.push_back(std::move(crack));
}

/// Directions of growth come from stress intensities, which only some laws have.
void check_hoop_materials(Table& table, const Case& c, const CrackSpec& crack) {
  const bool by_intensity = crack.is_surface() && crack.growth.criterion == GrowthCriterion::hoop;
  const bool turns = crack.growth.direction == GrowthDirection::hoop;
  if (crack.growth.criterion == GrowthCriterion::none || !(turns || by_intensity)) return;
  for (int b = 0; b < std::ssize(c.bodies); ++b) {
    const Material* material = material_of(c, c.bodies[b]);
    if (!material || !crack.cuts(b, c.bodies[b].group) || is_prescribed(c, b)) continue;
    if (material->model == "hypoelastic" || material->model == "neo_hookean") continue;
    return table.error("",
                       fmt::format("{}: growth by hoop stress needs stress intensities, which the model {} of body {} "
                                   "has not; use hypoelastic or neo_hookean, or criterion = \"energy\" with "
                                   "direction = \"straight\"",
                                   crack.source, in_quotes(material->model), b));
  }
}

}  // namespace

void read_cracks(Table& root, Draft& draft) {
  Case& c = draft.result;
  auto tables = root.tables("cracks");
  for (Table& table : tables)
    c.domain.dimension == 3 ? read_surface(std::move(table), draft) : read_crack(std::move(table), draft);
  Table settings = root.table("crack");
  if (draft.bodies_known && root.error_count() == 0)
    for (const CrackSpec& crack : c.cracks) check_hoop_materials(root, c, crack);
  if (settings.present() && c.cracks.empty()) settings.error("", "is given without [[cracks]]; remove it");
  if (settings.has("j_radius")) {
    const auto radii = settings.numbers("j_radius", not_negative);
    if (radii.size() != 2 || !(radii[0] < radii[1]))
      settings.error("j_radius", "must hold two numbers of cells, the smaller first");
    else
      c.crack.j_radius = {radii[0], radii[1]};
  }
  c.crack.split = static_cast<int>(settings.integer("split", 0, 0, 1000000));
  if (c.crack.split > 0 && c.domain.dimension == 3)
    settings.error("split", "is for 2D: parts do not become bodies in 3D yet; remove it");
  settings.finish();
  if (c.cracks.empty()) return;
  Table contact = root.table("contact");
  if (c.contact.release != Release::reaction) contact.error("release", "must be \"reaction\" where there are cracks");
  if (c.contact.normals != NormalSource::volume_gradient)
    contact.error("normals", "must be \"volume_gradient\" where there are cracks");
  if (c.contact.normal_choice != NormalChoice::common)
    contact.error("normal_choice", "must be \"common\" where there are cracks");
  if (c.contact.law == ContactLaw::none)
    contact.error("law", "must not be \"none\" where there are cracks, which cut fields of bodies; use \"stick\"");
  const auto pulls = [](const CrackSpec& crack) { return crack.has_tractions(); };
  if (std::ranges::any_of(c.cracks, pulls) && c.solver.stress_update != StressUpdate::both &&
      c.solver.stress_update != StressUpdate::first)
    root.table("solver").error("stress_update",
                               "must be \"both\" or \"first\" where cracks have interfaces or cohesive laws");
  if (c.contact.separation > 0) contact.error("separation", "must be 0 where there are cracks");
}

}  // namespace cairn::reading
