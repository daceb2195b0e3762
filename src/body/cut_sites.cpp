#include "cairn/body/cut_sites.hpp"

#include <algorithm>
#include <cstdlib>

namespace cairn {
namespace {

/// Calls f(neighbour) for the 3^Dim - 1 neighbours of a site.
template <int Dim, class F>
void for_neighbours(const Index<Dim>& site, F&& f) {
  Box<Dim> around;
  for (int d = 0; d < Dim; ++d) around.lower[d] = site[d] - 1, around.upper[d] = site[d] + 2;
  for_each(around, [&](const Index<Dim>& other) {
    if (other != site) f(other);
  });
}

template <int Dim>
bool share_a_face(const Index<Dim>& a, const Index<Dim>& b) {
  int apart = 0;
  for (int d = 0; d < Dim; ++d) apart += std::abs(a[d] - b[d]);
  return apart == 1;
}

}  // namespace

bool is_round(const Shape& shape) {
  if (const auto* compound = std::get_if<Compound>(&shape))
    return std::all_of(compound->of.begin(), compound->of.end(), is_round);
  return std::visit(
      [](const auto& s) {
        return requires { s.round; };
      },
      shape);
}

template <int Dim>
CutSites<Dim>::CutSites(const Shape& shape, const Vec3& origin, const Vec3& spacing, const Box<Dim>& sites)
    : origin_(origin), spacing_(spacing), box_(sites) {
  for (int d = 0; d < Dim; ++d) box_.lower[d] -= 2, box_.upper[d] += 2;
  measured_.reserve(box_.size());
  for_each(box_, [&](const Index<Dim>& site) { measured_.push_back(measured(shape, site)); });
}

template <int Dim>
PointSite CutSites<Dim>::measured(const Shape& shape, const Index<Dim>& site) const {
  const Vec3 middle = place(site, [](int) { return 0.5; });
  int corners = 0;
  for (int corner = 0; corner < (1 << Dim); ++corner)
    corners += contains(shape, place(site, [&](int d) { return (corner >> d) & 1; }));
  const bool middle_in = contains(shape, middle);
  if (middle_in && corners == 1 << Dim) return {1, middle};
  if (!middle_in && corners == 0) return {};
  constexpr int side = Dim == 2 ? 8 : 4;
  Box<Dim> samples;
  samples.upper.fill(side);
  int in = 0;
  Vec3 sum = Vec3::Zero();
  for_each(samples, [&](const Index<Dim>& sample) {
    const Vec3 x = place(site, [&](int d) { return (sample[d] + 0.5) / side; });
    if (contains(shape, x)) ++in, sum += x;
  });
  if (in == 0) return {};
  return {static_cast<double>(in) / static_cast<double>(samples.size()), sum / in};
}

template <int Dim>
std::vector<Index<Dim>> CutSites<Dim>::receivers(const Index<Dim>& site) const {
  std::vector<Index<Dim>> beside, around;
  for_neighbours<Dim>(site, [&](const Index<Dim>& other) {
    if (!holds_point(other)) return;
    around.push_back(other);
    if (share_a_face<Dim>(site, other)) beside.push_back(other);
  });
  return beside.empty() ? around : beside;
}

template <int Dim>
PointSite CutSites<Dim>::at(const Index<Dim>& site) const {
  if (!holds_point(site)) return {};
  const PointSite& own = measured_[box_.offset(site)];
  double share = own.share;
  Vec3 moment = own.share * own.position;
  bool cut = own.share < 1;
  for_neighbours<Dim>(site, [&](const Index<Dim>& other) {
    const PointSite& sliver = measured_[box_.offset(other)];
    if (sliver.share == 0 || holds_point(other)) return;
    const auto to = receivers(other);
    if (std::find(to.begin(), to.end(), site) == to.end()) return;
    const double part = sliver.share / static_cast<double>(to.size());
    share += part, moment += part * sliver.position, cut = true;
  });
  if (!cut) return own;
  // A sum of several slivers may lie beyond.
  const Vec3 lower = place(site, [](int) { return 0.01; }), upper = place(site, [](int) { return 0.99; });
  return {share, (moment / share).cwiseMax(lower).cwiseMin(upper)};
}

template class CutSites<2>;
template class CutSites<3>;

}  // namespace cairn
