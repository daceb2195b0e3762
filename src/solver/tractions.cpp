// Interfaces and cohesive laws of cracks: which crack points have them, and what passes between their faces in a step.

#include "tractions.hpp"

#include <fmt/format.h>

#include "cairn/core/error.hpp"
#include "cairn/io/agreement.hpp"
#include "cairn/io/first_step.hpp"
#include "cairn/parallel/crack_exchange.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {
namespace {

std::optional<TractionLaw> law_of(const CrackSpec& spec) {
  if (spec.law == CrackLaw::interface) return TractionLaw(spec.interface);
  if (spec.law == CrackLaw::cohesive || spec.growth.cohesive) return TractionLaw(spec.cohesive);
  return {};
}

/// Bodies whose bounds a crack's line reaches.
std::vector<const Shape*> shapes_near(const Case& c, const CrackSpec& spec, const std::vector<Vec3>& line) {
  Bounds of_line{line[0], line[0]};
  for (const Vec3& x : line) of_line.lower = of_line.lower.cwiseMin(x), of_line.upper = of_line.upper.cwiseMax(x);
  std::vector<const Shape*> shapes;
  for (std::size_t b = 0; b < c.bodies.size(); ++b) {
    const Bounds box = bounds(c.bodies[b].shape);
    const bool apart = (box.lower.array() > of_line.upper.array()).head<2>().any() ||
                       (box.upper.array() < of_line.lower.array()).head<2>().any();
    if (!apart && spec.cuts(static_cast<int>(b), c.bodies[b].group)) shapes.push_back(&c.bodies[b].shape);
  }
  return shapes;
}

}  // namespace

std::vector<double> bound_lengths(const Case& c, const CrackSpec& spec, const std::vector<Vec3>& line) {
  constexpr int samples = 64;  // of each half of a segment
  const auto shapes = shapes_near(c, spec, line);
  const bool ranged = spec.law == CrackLaw::cohesive;
  std::vector<double> lengths(line.size(), 0.0);
  double along = 0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const double size = (line[i + 1] - line[i]).norm();
    for (int s = 0; s < 2 * samples; ++s) {
      const double at = (s + 0.5) / (2 * samples), here = along + at * size;
      const Vec3 x = line[i] + at * (line[i + 1] - line[i]);
      const bool in_range = !ranged || (here >= spec.cohesive.range[0] && here <= spec.cohesive.range[1]);
      if (in_range && std::ranges::any_of(shapes, [&](const Shape* shape) { return contains(*shape, x); }))
        lengths[s < samples ? i : i + 1] += size / (2 * samples);
    }
    along += size;
  }
  return lengths;
}

template <int Dim>
void Simulation<Dim>::define_tractions(const Case& c) {
  std::vector<std::optional<TractionLaw>> laws;
  for (const CrackSpec& spec : c.cracks) laws.push_back(law_of(spec));
  if (std::ranges::none_of(laws, [](const auto& law) { return law.has_value(); })) return;
  traction_laws_ = std::move(laws);
  traction_dt_ = longest_traction_step(c);
}

/// Crack points get the lengths that they stand for, at the start.
template <int Dim>
void Simulation<Dim>::bind_faces(const Case& c) {
  std::vector<std::vector<double>> lengths(c.cracks.size());
  for (auto& patch : patches_)
    for (auto& point : patch.cracks) {
      const CrackSpec& spec = c.cracks[point.crack];
      if (spec.law != CrackLaw::interface && spec.law != CrackLaw::cohesive) continue;
      auto& of_crack = lengths[point.crack];
      const double h = lattice_.smallest_spacing();
      if (of_crack.empty())
        of_crack =
            Dim == 3 ? bound_areas(c, spec, crack_surface(spec, h)) : bound_lengths(c, spec, refined_crack(spec, h));
      point.bond.length = of_crack[Dim == 3 ? point.index : point.index / CrackPoint<Dim>::index_step];
      if (point.bond.length > 0) point.bond.state = Bond::holds;
    }
}

/// Opening and slip, with the directions in which they are counted.
template <int Dim>
struct Opening {
  Vec<Dim> normal = Vec<Dim>::Zero(), along = Vec<Dim>::Zero();
  TractionLaw::Modes d{};

  Opening(const CrackSegments<Dim>& segments, const CrackPoint<Dim>& point, const Vec<Dim>& opening) {
    normal = segments.normal_at(point);
    if constexpr (Dim == 2)
      along = {normal.y(), -normal.x()};
    else
      along = (opening - opening.dot(normal) * normal).normalized();
    d = {opening.dot(normal), opening.dot(along)};
  }
};

/// \throws InputError on every rank where faces are bound though their crack has no law that binds them
template <int Dim>
void Simulation<Dim>::check_bonds() const {
  std::string error;
  for (const auto& patch : patches_)
    for (const auto& point : patch.cracks)
      if (point.bond.state != Bond::none && (traction_laws_.empty() || !traction_laws_[point.crack]))
        error = fmt::format("the checkpoint binds the faces at point {} of crack {}, which has no such law",
                            point.index, point.crack);
  error = common_error(comm_, error);
  if (!error.empty()) throw InputError(error);
}

/// Crack points learn of their faces' new places: their history, and what they pull with in the next step.
template <int Dim>
void Simulation<Dim>::follow_openings() {
  if (traction_laws_.empty()) return;
  for (auto& forces : row_forces_) forces.clear();
  for (auto& patch : patches_) {
    if (patch.cracks.empty()) continue;
    find_cracks(patch);
    for (auto& point : patch.cracks) {
      if (point.bond.state == Bond::none) continue;
      if (point.bond.state == Bond::holds && point.faces_filled != 3) continue;  // it rests: the line may turn there
      const TractionLaw& law = *traction_laws_[point.crack];
      const Opening<Dim> opening(segments_of(patch), point, point.opening());
      law.follow(opening.d, point.bond);
      const auto T = law.traction(opening.d, point.bond);
      point.traction = T[0] * opening.normal + T[1] * opening.along;
    }
  }
}

template <int Dim>
std::array<double, 2> Simulation<Dim>::energies_of(const CrackPoint<Dim>& point) const {
  if (point.bond.state == Bond::none) return {0, 0};
  const TractionLaw& law = *traction_laws_[point.crack];
  // Tractions of a mode act along its opening.
  const double stored = 0.5 * point.traction.dot(point.opening());
  return {point.bond.length * stored, point.bond.length * law.dissipated(point.bond)};
}

/// The tractions of a step are the mean over the way that the opening is about to go: what they take is then what the
/// law takes, also where its curve bends or ends.
template <int Dim>
void Simulation<Dim>::find_tractions(std::size_t p) {
  if (traction_laws_.empty()) return;
  constexpr int parts = 8;
  const double share = strain_share();
  const auto traction = [&](const CrackPoint<Dim>& point, const Vec<Dim>& ahead) -> Vec<Dim> {
    const TractionLaw& law = *traction_laws_[point.crack];
    const Vec<Dim> way = (ahead - point.opening()) / share;
    Bond bond = point.bond;  // what it will be then; its history follows the openings at the ends of steps
    Vec<Dim> sum = Vec<Dim>::Zero();
    for (int part = 0; part < parts; ++part) {
      const Opening<Dim> opening(segments_[p], point, ahead + ((part + 0.5) / parts - 0.5) * way);
      law.follow(opening.d, bond);
      const auto T = law.traction(opening.d, bond);
      sum += T[0] * opening.normal + T[1] * opening.along;
    }
    return sum / parts;
  };
  row_forces_[p] = find_row_forces<Dim>(surroundings_of(patches_[p]), share * dt_, traction);
}

template <int Dim>
void Simulation<Dim>::exchange_tractions() {
  if (!traction_laws_.empty()) exchange_row_forces(*traction_messages_, table_, patches_, lattice_, row_forces_);
}

#define CAIRN_INSTANTIATE(Dim)                                                               \
  template void Simulation<Dim>::define_tractions(const Case&);                              \
  template void Simulation<Dim>::check_bonds() const;                                        \
  template void Simulation<Dim>::bind_faces(const Case&);                                    \
  template void Simulation<Dim>::follow_openings();                                          \
  template std::array<double, 2> Simulation<Dim>::energies_of(const CrackPoint<Dim>&) const; \
  template void Simulation<Dim>::find_tractions(std::size_t);                                \
  template void Simulation<Dim>::exchange_tractions();
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn
