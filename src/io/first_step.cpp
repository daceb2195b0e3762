#include "cairn/io/first_step.hpp"

#include <fmt/format.h>

#include <cmath>

#include "cairn/crack/traction.hpp"
#include "cairn/material/registry.hpp"
#include "case_sections.hpp"

namespace cairn {
namespace {

double wave_speed_of(const Material& material) {
  return std::sqrt(longitudinal_modulus(make_law(material.model, material.parameters, material.plane)) /
                   material.density);
}

/// The largest speed of a body's points: its own, and at the far corner of its bounds that of its spin.
double point_speed_of(const Case& c, int index) {
  const BodySpec& body = c.bodies[index];
  Vec3 velocity = body.velocity, spin = body.angular_velocity;
  for (const auto& drive : c.drives)
    if (selects(drive, body, index, c.domain))
      velocity = Vec3(drive.velocity.largest(), 0, 0), spin = Vec3(0, 0, drive.angular_velocity.largest());
  if (spin == Vec3::Zero()) return velocity.norm();
  double reach = 0;
  if (const auto* ball = std::get_if<Ball>(&body.shape)) {
    reach = ball->radius;
  } else {
    const Bounds b = bounds(body.shape);
    const Vec3 middle = centre(body.shape);
    Vec3 far = Vec3::Zero();
    for (int k = 0; k < c.domain.dimension; ++k)
      far[k] = std::max(std::min(b.upper[k], c.domain.upper[k]) - middle[k],
                        middle[k] - std::max(b.lower[k], c.domain.lower[k]));
    reach = far.norm();
  }
  return velocity.norm() + spin.norm() * reach;
}

}  // namespace

double longest_traction_step(const Case& c) {
  constexpr double stable = 0.5;  // D dt^2 over density times cell; waves through interfaces are stable up to .7
  double longest = std::numeric_limits<double>::infinity();
  for (const CrackSpec& crack : c.cracks) {
    if (!crack.has_tractions()) continue;
    const TractionLaw law =
        crack.law == CrackLaw::interface ? TractionLaw(crack.interface) : TractionLaw(crack.cohesive);
    for (int b = 0; b < std::ssize(c.bodies); ++b)
      if (crack.cuts(b, c.bodies[b].group) && !reading::is_prescribed(c, b))
        longest = std::min(longest, std::sqrt(stable * c.materials[c.bodies[b].material].density *
                                              smallest_cell(c.domain) / law.largest_stiffness()));
  }
  return longest;
}

FirstStep first_step(const Case& c) {
  std::vector<double> waves;
  for (const auto& material : c.materials) waves.push_back(wave_speed_of(material));
  FirstStep step;
  bool deformable = false;
  for (int i = 0; i < std::ssize(c.bodies); ++i) {
    step.point_speed = std::max(step.point_speed, point_speed_of(c, i));
    if (reading::is_prescribed(c, i)) continue;
    deformable = true;
    step.wave_speed = std::max(step.wave_speed, waves[c.bodies[i].material]);
  }
  if (!deformable) step.wave_speed = *std::ranges::max_element(waves);
  step.crossing = smallest_cell(c.domain) / (step.wave_speed + step.point_speed);
  step.dt = c.time.dt > 0 ? c.time.dt : std::min(c.time.cfl * step.crossing, longest_traction_step(c));
  return step;
}

namespace reading {

void check_time_step(Case& c, Errors& errors) {
  constexpr double near = 0.9;  // share of the limit from which a step is said to be long
  constexpr double worth_telling = 0.5;
  const FirstStep first = first_step(c);
  const double of_cracks = longest_traction_step(c), of_waves = c.time.cfl * first.crossing;
  if (c.time.dt > of_cracks)
    errors.add(
        {c.file.string(), 0}, "time.dt",
        fmt::format("{:.6g} s is too long for the stiffness between the faces of a crack; give at most {:.6g} s, "
                    "or leave it to time.cfl",
                    c.time.dt, of_cracks));
  if (of_cracks < worth_telling * of_waves)
    c.warnings.push_back(
        fmt::format("{}: the stiffness between the faces of a crack makes steps {:.2g} times shorter; "
                    "what is so stiff is nearly perfect: leave it out, or make it softer",
                    c.file.string(), of_waves / of_cracks));
  if (!(c.time.dt > near * first.crossing)) return;
  const std::string text =
      fmt::format("{:.6g} s is {:.3g} of the time that a wave and a point take through a cell at the start, {:.6g} s",
                  c.time.dt, c.time.dt / first.crossing, first.crossing);
  if (c.time.dt > first.crossing)
    errors.add({c.file.string(), 0}, "time.dt", text + "; give a smaller one, or leave it to time.cfl");
  else
    c.warnings.push_back(fmt::format("{}: time.dt: {}; the run ends where it is longer", c.file.string(), text));
}

}  // namespace reading
}  // namespace cairn
