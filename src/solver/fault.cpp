#include "fault.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cairn/body/deformation.hpp"

namespace cairn {
namespace {

/// `size` numbers of a point, from column `first` on.
template <int Dim>
std::vector<double> numbers_of(const Points<Dim>& points, int p, int first, int size) {
  std::vector<double> values;
  for (int c = first; c < first + size; ++c) values.push_back(points.column(c)[p]);
  return values;
}

bool all_finite(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double a) { return std::isfinite(a); });
}

/// As fault_of, in words that go on from the point's name.
template <int Dim>
Fault complaint_of(const Points<Dim>& points, int p) {
  using C = PointColumns<Dim>;
  const double J = volume_ratio(points, p);
  if (std::isfinite(J) && J <= 0) return {Fault::inverted, fmt::format("is inverted: det F = {:.6g}", J)};
  const auto report = [](Fault::Kind kind, const char* name, const std::vector<double>& values, const char* unit) {
    return Fault{kind, fmt::format("is not finite: {} ({:.6g}){}", name, fmt::join(values, ", "), unit)};
  };
  const auto x = numbers_of(points, p, C::position, Dim), v = numbers_of(points, p, C::velocity, Dim);
  if (!all_finite(x) || !all_finite(v)) return report(Fault::motion, "velocity", v, " m/s");
  if (!std::isfinite(J)) return report(Fault::state, "det F =", {J}, "");
  const auto stress = numbers_of(points, p, C::stress, symmetric_size<Dim>);
  if (!all_finite(stress)) return report(Fault::state, "stress", stress, " Pa");
  return {};
}

}  // namespace

template <int Dim>
Fault fault_of(const Points<Dim>& points, int p, int body) {
  Fault fault = complaint_of(points, p);
  if (fault.kind != Fault::none)
    fault.text = fmt::format("point {} of body {} at ({:.6g}) m {}", points.ids()[p], body,
                             fmt::join(numbers_of(points, p, PointColumns<Dim>::position, Dim), ", "), fault.text);
  return fault;
}

template <int Dim>
Fault find_fault(const std::vector<Patch<Dim>>& patches, const std::vector<Body>& bodies) {
  Fault worst{Fault::none, "a point's wave speed or velocity is too large for a number"};
  for (const auto& patch : patches)
    for (const auto& piece : patch.pieces)
      for (int p = 0; p < piece.points.size() && !bodies[piece.body].rigid; ++p) {
        const Fault fault = fault_of(piece.points, p, piece.body);
        if (fault.kind > worst.kind) worst = fault;
      }
  return worst;
}

template Fault fault_of(const Points<2>&, int, int);
template Fault fault_of(const Points<3>&, int, int);
template Fault find_fault(const std::vector<Patch<2>>&, const std::vector<Body>&);
template Fault find_fault(const std::vector<Patch<3>>&, const std::vector<Body>&);

}  // namespace cairn
