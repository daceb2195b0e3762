// [domain.deform]: a periodic domain whose lengths change.

#include <fmt/format.h>

#include "case_names.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

constexpr std::string_view axis_names[] = {"x", "y", "z"};

bool pulls_along(const MotionTable& gravity, int k) {
  if (!gravity.formulas.empty()) return gravity.formulas[k].text() != "0";
  return std::ranges::any_of(gravity.values, [&](const Vec3& g) { return g[k] != 0; });
}

/// By default a stress that is missing in a material as hard as the hardest is there in the time that a wave takes
/// through a few cells, one that the domain has to yield for in a hundred; and the domain does not come closer faster
/// than the speed at which that material would strike with the stress asked for.
AxisDeformation read_axis(Table axis, double length, double cell, const Hardness& hardness, double end) {
  using By = AxisDeformation::By;
  constexpr double quick = 4, steady = 100;  // cells
  AxisDeformation result;
  const bool rate = axis.has("strain_rate"), stress = axis.has("stress");
  if (rate == stress)
    axis.missing(stress ? "stress" : "strain_rate",
                 stress ? "is given beside strain_rate; give one of the two"
                        : "is missing; give strain_rate [1/s] or stress [Pa, positive in tension]: a number, rows of "
                          "time and value, or a formula");
  result.by = stress ? By::stress : By::strain_rate;
  result.target = axis.motion(stress ? "stress" : "strain_rate", 1);
  result.target.repeat = axis.boolean("repeat", false) && !result.target.times.empty();
  if (stress) {
    result.viscosity = axis.number("viscosity", quick * hardness.impedance * cell, positive);
    result.memory = axis.number("memory", steady * cell / hardness.wave_speed, positive);
    const double most = result.target.largest(end) / (hardness.impedance * length);
    result.largest_rate = axis.number("largest_rate", most > 0 ? most : 0.01 * hardness.wave_speed / length, positive);
  }
  axis.finish();
  return result;
}

/// What does not deform with the domain.
void refuse_others(Table& deform, const Case& c) {
  const auto refuse = [&](bool there, const char* what) {
    if (there) deform.error("", fmt::format("{} cannot be in a domain that deforms", what));
  };
  refuse(!c.drives.empty(), "driven bodies");
  const auto is_rigid = [&](const BodySpec& b) {
    const Material* material = material_of(c, b);
    return material && material->model == "rigid";
  };
  refuse(std::ranges::any_of(c.bodies, is_rigid), "rigid bodies");
  refuse(!c.cracks.empty(), "cracks");
  refuse(!c.inserts.empty(), "bodies that come later ([[insert]])");
  refuse(c.solver.shape == ShapeFunction::cpdi, "points with solver.shape = \"cpdi\"");
  for (int k = 0; k < c.domain.dimension; ++k)
    if (c.domain.deformation.axes[k].active() && pulls_along(c.domain.gravity, k))
      deform.error(axis_names[k], "is a direction of gravity, which has no bottom in a periodic domain");
}

}  // namespace

void read_deform(Table deform, Draft& draft) {
  Case& c = draft.result;
  if (!deform.present() || !draft.domain_known) return;
  const Hardness hardness = hardness_of(c.materials);
  for (int k = 0; k < c.domain.dimension; ++k) {
    const std::string key(axis_names[k]);
    if (!deform.has(key)) continue;
    if (!c.domain.periodic[k])
      deform.error(key, fmt::format("direction {} is not periodic; there walls move, at [boundary]", key));
    c.domain.deformation.axes[k] = read_axis(deform.table(key), c.domain.upper[k] - c.domain.lower[k],
                                             smallest_cell(c.domain), hardness, c.time.end);
  }
  if (!c.domain.deformation.active()) deform.missing("x", "is missing; give x, y or z: what deforms");
  refuse_others(deform, c);
  deform.finish();
}

}  // namespace cairn::reading
