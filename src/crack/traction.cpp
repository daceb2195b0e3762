#include "cairn/crack/traction.hpp"

#include <algorithm>

namespace cairn {
namespace {

double critical_of(const CohesiveMode& mode) {
  return std::visit([](const auto& law) { return law.critical; }, mode);
}
double traction_of(const CohesiveMode& mode, double d) {
  return std::visit([&](const auto& law) { return law.traction(d); }, mode);
}
double area_of(const CohesiveMode& mode, double d) {
  return std::visit([&](const auto& law) { return law.area(d); }, mode);
}

/// What a cohesive law sees of an opening.
TractionLaw::Modes seen(const TractionLaw::Modes& d) { return {std::max(0.0, d[0]), std::abs(d[1])}; }

double finite(double stiffness) { return std::isfinite(stiffness) ? stiffness : 0.0; }

}  // namespace

CohesiveMode make_cohesive_mode(const CohesiveSpec& spec, int mode) {
  const double S = spec.strength[mode], G = spec.energy[mode];
  if (spec.shape == CohesiveShape::exponential) {
    const double scale = G / (std::exp(1.0) * S);
    return ExponentialLaw{S, scale, 8 * scale};
  }
  const double critical = 2 * G / S;
  if (spec.shape == CohesiveShape::linear) return BrittleLaw{S, critical};
  return TriangleLaw{S, critical, spec.peak * critical};
}

TractionLaw::TractionLaw(const InterfaceSpec& spec)
    : opening_{finite(spec.opening), finite(spec.sliding)}, closing_{finite(spec.closing), finite(spec.sliding)} {}

TractionLaw::TractionLaw(const CohesiveSpec& spec)
    : cohesive_(true),
      modes_{make_cohesive_mode(spec, 0), make_cohesive_mode(spec, 1)},
      energy_{spec.energy},
      exponent_(spec.exponent) {}

TractionLaw::Modes TractionLaw::traction(const Modes& d, const Bond& bond) const {
  Modes T{};
  if (bond.state != Bond::holds) return T;
  for (int m = 0; m < 2; ++m)
    if (!cohesive_)
      T[m] = (d[m] > 0 ? opening_ : closing_)[m] * d[m];
    else if (bond.peak[m] > 0 && (m == 1 || d[0] > 0))
      T[m] = traction_of(modes_[m], bond.peak[m]) * d[m] / bond.peak[m];
  return T;
}

void TractionLaw::follow(const Modes& d, Bond& bond) const {
  if (!cohesive_ || bond.state != Bond::holds) return;
  const Modes now = seen(d), before = bond.peak;
  Modes after;
  for (int m = 0; m < 2; ++m) after[m] = std::max(before[m], std::min(now[m], critical_of(modes_[m])));
  const auto breaks_at = [&](double share) {
    for (int m = 0; m < 2; ++m) bond.peak[m] = std::lerp(before[m], after[m], share);
    return breaks(bond);
  };
  if (!breaks_at(1)) return;
  // On the way there: beyond that point it takes nothing.
  double holds = 0, broken = 1;
  for (int halving = 0; exponent_ > 0 && halving < 50; ++halving) {
    const double middle = 0.5 * (holds + broken);
    (breaks_at(middle) ? broken : holds) = middle;
  }
  breaks_at(broken);
  Modes last;
  for (int m = 0; m < 2; ++m) last[m] = std::min(now[m], bond.peak[m]);
  bond.dissipated = dissipated_unbroken(bond) + stored(last, bond);
  bond.state = Bond::broken;
}

bool TractionLaw::breaks(const Bond& bond) const {
  double sum = 0;
  for (int m = 0; m < 2; ++m) {
    if (bond.peak[m] >= critical_of(modes_[m])) return true;
    if (exponent_ > 0) sum += std::pow(area_of(modes_[m], bond.peak[m]) / energy_[m], exponent_);
  }
  return sum >= 1;
}

double TractionLaw::stored(const Modes& d, const Bond& bond) const {
  const Modes T = traction(d, bond);
  return 0.5 * (T[0] * d[0] + T[1] * d[1]);
}

double TractionLaw::dissipated_unbroken(const Bond& bond) const {
  double sum = 0;
  for (int m = 0; m < 2; ++m)
    sum += std::max(0.0, area_of(modes_[m], bond.peak[m]) - 0.5 * traction_of(modes_[m], bond.peak[m]) * bond.peak[m]);
  return sum;
}

double TractionLaw::dissipated(const Bond& bond) const {
  if (bond.state == Bond::broken) return bond.dissipated;
  return cohesive_ && bond.state == Bond::holds ? dissipated_unbroken(bond) : 0.0;
}

double TractionLaw::largest_stiffness() const {
  double most = 0;
  for (int m = 0; m < 2; ++m) {
    const double mode = std::visit([](const auto& law) { return law.stiffness(); }, modes_[m]);
    most = std::max(most, cohesive_ ? mode : std::max(opening_[m], closing_[m]));
  }
  return most;
}

}  // namespace cairn
