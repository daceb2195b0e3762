// [[cracks]] and [crack] as a file that reads back to the same case.

#include "case_writer.hpp"

namespace cairn::reading {
namespace {

std::string text_or_perfect(double stiffness) { return text_of(std::isfinite(stiffness) ? stiffness : -1.0); }

void write_growth(Writer& out, const GrowthSpec& growth, bool of_surface) {
  std::string text = fmt::format("{{ criterion = \"{}\"", name_of(growth_criterion_names, growth.criterion));
  if (growth.criterion == GrowthCriterion::hoop) text += ", toughness = " + text_of(growth.toughness);
  if (growth.criterion != GrowthCriterion::hoop) text += ", energy = " + text_of(growth.energy);
  if (growth.criterion == GrowthCriterion::steady)
    text += fmt::format(", speed = {}, start = {}", text_of(growth.speed), text_of(growth.start));
  text += fmt::format(", direction = \"{}\"", name_of(growth_direction_names, growth.direction));
  if (!of_surface) text += ", most = " + text_of(growth.most);
  text += fmt::format(", length = {}, every = {}", text_of(growth.length), growth.every);
  if (!of_surface) text += fmt::format(", cohesive = {}", growth.cohesive);
  text += " }";
  out.raw("growth", text);
}

void write_crack_law(Writer& out, const CrackSpec& crack) {
  if (crack.law == CrackLaw::friction || crack.law == CrackLaw::cohesive) out.key("friction", crack.friction);
  if (crack.law == CrackLaw::interface) {
    out.raw("normal_stiffness", text_or_perfect(crack.interface.opening));
    out.raw("closing_stiffness", text_or_perfect(crack.interface.closing));
    out.raw("tangential_stiffness", text_or_perfect(crack.interface.sliding));
  }
  if (crack.law == CrackLaw::cohesive || crack.growth.cohesive) {
    const CohesiveSpec& law = crack.cohesive;
    std::string text =
        fmt::format("{{ shape = \"{}\", strength = {}, energy = {}", name_of(cohesive_shape_names, law.shape),
                    list_of(law.strength, 2), list_of(law.energy, 2));
    if (law.shape == CohesiveShape::triangle) text += ", peak = " + text_of(law.peak);
    text += ", exponent = " + text_of(law.exponent);
    if (!crack.is_surface()) text += fmt::format(", from = {}, to = {}", text_of(law.range[0]), text_of(law.range[1]));
    out.raw("cohesive", text + " }");
  }
  if (crack.growth.criterion != GrowthCriterion::none) write_growth(out, crack.growth, crack.is_surface());
}

/// Where a crack lies.
void write_crack_place(Writer& out, const CrackSpec& crack, int dimension) {
  std::string points;
  for (const Vec3& x : crack.points) points += (points.empty() ? "" : ", ") + list_of(x, dimension);
  if (!points.empty()) out.raw("points", "[" + points + "]");
  if (dimension == 2)
    out.raw("ends", fmt::format("[\"{}\", \"{}\"]", name_of(crack_end_names, crack.ends[0]),
                                name_of(crack_end_names, crack.ends[1])));
  if (dimension == 3 && !points.empty()) out.raw("extrude", list_of(crack.extrude, 3));
  if (crack.disk)
    out.raw("disk", fmt::format("{{ centre = {}, normal = {}, radius = {} }}", list_of(crack.disk->centre, 3),
                                list_of(crack.disk->normal, 3), text_of(crack.disk->radius)));
  if (crack.file) out.raw("triangles", text_of(crack.file->name)), out.key("scale", crack.file->scale);
}

}  // namespace

void write_cracks(Writer& out, const Case& c) {
  for (const auto& crack : c.cracks) {
    out.section("[[cracks]]");
    write_crack_place(out, crack, c.domain.dimension);
    out.key("law", name_of(crack_law_names, crack.law));
    write_crack_law(out, crack);
    if (!crack.groups.empty()) out.raw("bodies", list_of(crack.groups, std::ssize(crack.groups)));
    if (!crack.ids.empty()) out.raw("ids", list_of(crack.ids, std::ssize(crack.ids)));
  }
  if (c.cracks.empty()) return;
  out.section("[crack]");
  out.raw("j_radius", list_of(c.crack.j_radius, 2));
  out.key("split", c.crack.split);
}

}  // namespace cairn::reading
