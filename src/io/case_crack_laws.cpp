// Keys of [[cracks]] for what passes between faces and for growth.

#include <fmt/format.h>

#include "cairn/core/options.hpp"
#include "case_names.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

constexpr Range share = {0, 1, true, true, false};

/// A stiffness [Pa/m]; negative: perfect (Nairn 2013, section 2.7).
double stiffness(Table& table, std::string_view key) {
  const double D = table.number(key, -1.0);
  return D < 0 ? infinity : D;
}

/// A number for opening and one for slip, or one for both.
std::array<double, 2> by_mode(Table& table, std::string_view key, std::string_view what) {
  if (!table.has(key)) table.missing(key, fmt::format("is missing; give {} for opening and for slip", what));
  if (!table.has(key)) return {1, 1};
  const Vec3 v = table.scalar_or_vector(key, 2, positive);
  return {v[0], v[1]};
}

void read_cohesive(Table table, CohesiveSpec& law) {
  law.shape = table.choice("shape", cohesive_shape_names, law.shape);
  law.strength = by_mode(table, "strength", "strengths [Pa]");
  law.energy = by_mode(table, "energy", "energies G_c [J/m2]");
  if (table.has("peak") && law.shape != CohesiveShape::triangle)
    table.error("peak", "is only for shape = \"triangle\"");
  law.peak = table.number("peak", law.peak, share);
  law.exponent = table.number("exponent", law.exponent, not_negative);
  law.range[0] = table.number("from", 0.0, not_negative);
  law.range[1] = table.number("to", infinity, {0, infinity, true, false, true});
  if (law.range[0] >= law.range[1]) table.error("to", "must be larger than `from`");
  table.finish();
}

void read_interface(Table& table, CrackSpec& crack) {
  InterfaceSpec& law = crack.interface;
  law.opening = stiffness(table, "normal_stiffness"), law.closing = stiffness(table, "closing_stiffness");
  law.sliding = stiffness(table, "tangential_stiffness");
  if (!std::isfinite(law.opening) && !std::isfinite(law.sliding))
    table.error("law",
                "is \"interface\" and perfect in all directions; give normal_stiffness or tangential_stiffness "
                "[Pa/m], or use law = \"stick\"");
  if (std::isfinite(law.closing) && !std::isfinite(law.opening))
    table.error("closing_stiffness", "needs normal_stiffness: what cannot open does not close");
}

/// Surfaces grow in their plane.
void check_growth_of_surface(Table& table, const GrowthSpec& growth) {
  if (growth.criterion == GrowthCriterion::steady) table.error("criterion", "must be \"energy\" or \"hoop\" in 3D");
  if (growth.direction != GrowthDirection::straight)
    table.error("direction", "must be \"straight\" in 3D: rims grow in the plane of their surface");
  for (const auto* key : {"most", "cohesive"})
    if (table.has(key)) table.error(key, "is for growth in 2D");
}

void read_growth(Table table, CrackSpec& crack, bool has_cohesive) {
  GrowthSpec& growth = crack.growth;
  growth.criterion = table.choice("criterion", growth_criterion_names, std::nullopt);
  const auto criterion = growth.criterion;
  const auto only = [&](std::string_view key, GrowthCriterion of, std::string_view name) {
    if (table.has(key) && criterion != of) table.error(key, fmt::format("is only for criterion = \"{}\"", name));
  };
  only("toughness", GrowthCriterion::hoop, "hoop");
  for (const auto* key : {"speed", "start"}) only(key, GrowthCriterion::steady, "steady");
  if (criterion == GrowthCriterion::hoop) growth.toughness = table.number("toughness", std::nullopt, positive);
  if (criterion == GrowthCriterion::hoop && table.has("energy"))
    table.error("energy", "is for criterion = \"energy\" or \"steady\"; of \"hoop\" give the toughness");
  if (criterion == GrowthCriterion::energy) growth.energy = table.number("energy", std::nullopt, positive);
  if (criterion == GrowthCriterion::steady) {
    growth.speed = table.number("speed", std::nullopt, positive);
    growth.energy = table.number("energy", 0.0, not_negative), growth.start = table.number("start", 0.0, not_negative);
  }
  const bool turns = criterion == GrowthCriterion::hoop && !crack.is_surface();
  growth.direction =
      table.choice("direction", growth_direction_names, turns ? GrowthDirection::hoop : growth.direction);
  if (crack.is_surface()) check_growth_of_surface(table, growth);
  growth.most = table.number("most", infinity, {0, infinity, true, false, true});
  growth.length = table.number("length", growth.length, {0.1, 1, false, true, false});
  growth.every = static_cast<int>(table.integer("every", growth.every, 1, 1000000));
  growth.cohesive = table.boolean("cohesive", false);
  if (growth.cohesive && !has_cohesive)
    table.error("cohesive", "needs the crack's cohesive law: give `cohesive = { strength = ..., energy = ... }`");
  if (!crack.is_surface() && crack.ends[0] != CrackEnd::tip && crack.ends[1] != CrackEnd::tip)
    table.error("criterion", "needs a tip that grows; the crack has none: see `ends`");
  table.finish();
}

}  // namespace

void read_crack_law(Table& table, CrackSpec& crack) {
  crack.law = table.choice("law", crack_law_names, crack.law);
  if (table.has("friction") && crack.law != CrackLaw::friction && crack.law != CrackLaw::cohesive)
    table.error("friction", "is only for cracks with law = \"friction\" or \"cohesive\"");
  crack.friction = table.number("friction", crack.friction, friction_range);
  for (const auto* key : {"normal_stiffness", "closing_stiffness", "tangential_stiffness"})
    if (table.has(key) && crack.law != CrackLaw::interface)
      table.error(key, "is only for cracks with law = \"interface\"");
  if (crack.law == CrackLaw::interface) read_interface(table, crack);
  const bool has_cohesive = table.has("cohesive");
  if (has_cohesive && crack.is_surface())
    for (Table law = table.table("cohesive"); const auto* key : {"from", "to"})
      if (law.has(key)) law.error(key, "is for 2D: lengths along the crack's line");
  if (has_cohesive) read_cohesive(table.table("cohesive"), crack.cohesive);
  if (crack.law == CrackLaw::cohesive && !has_cohesive)
    table.missing("cohesive", "is missing; give { strength = [...], energy = [...] } for opening and slip");
  if (table.has("growth")) read_growth(table.table("growth"), crack, has_cohesive);
  if (has_cohesive && crack.law != CrackLaw::cohesive && !crack.growth.cohesive)
    table.error("cohesive", "is only for law = \"cohesive\", or growth with `cohesive = true`");
  const bool faces_bound = crack.law == CrackLaw::stick || crack.law == CrackLaw::interface;
  if (faces_bound && crack.growth.criterion != GrowthCriterion::none)
    table.error("growth", "is only for cracks whose faces part: friction, frictionless, free or cohesive");
}

}  // namespace cairn::reading
