#include "cairn/contact/settings.hpp"

namespace cairn {

template <int Dim>
ContactSettings<Dim> ContactSettings<Dim>::make(const ContactOptions& options, std::vector<ContactMaterial> materials,
                                                const FaceConditions<Dim>& faces) {
  ContactSettings s;
  s.options = options;
  s.materials = std::move(materials);
  const std::size_t n = s.materials.size();
  const auto friction_of = [](ContactLaw law, double mu) { return law == ContactLaw::frictionless ? 0.0 : mu; };
  s.pairs.assign(n * n, {options.law, friction_of(options.law, options.friction)});
  for (const auto& pair : options.pairs) {
    if (pair.material_a < 0 || pair.material_b < 0) continue;
    const PairLaw law{pair.law, friction_of(pair.law, pair.friction)};
    s.pairs[pair.material_a * n + pair.material_b] = s.pairs[pair.material_b * n + pair.material_a] = law;
  }
  s.faces = faces;
  s.gap = contact::TouchingGap::make(options, false);
  s.gap_at_wall = contact::TouchingGap::make(options, true);
  return s;
}

namespace {

/// The share of a hat that lies in front of a plane, s cells off its node.
double share_in_front(double s) {
  constexpr double least = 0.05;
  if (s >= 1) return 1;
  return s >= 0 ? 1 - 0.5 * (1 - s) * (1 - s) : std::max(least, 0.5 * (1 + s) * std::max(0.0, 1 + s));
}

}  // namespace

template <int Dim>
double ContactSettings<Dim>::room(const Index<Dim>& place, const Lattice<Dim>& lattice, int but_for) const {
  double room = lattice.cell_volume();
  for (int face = 0; face < 2 * Dim; ++face) {
    if (face == but_for) continue;
    const FaceType type = faces[face].type;
    if (type == FaceType::wall && faces[face].moves)
      room *= share_in_front(cells_to_plane<Dim>(place, face, faces[face], lattice));
    else if ((type == FaceType::fixed || type == FaceType::wall) && at_face<Dim>(place, face, lattice))
      room *= 0.5;
  }
  return room;
}

template <int Dim>
Index<Dim> ContactSettings<Dim>::node_at_walls(Index<Dim> place, const Lattice<Dim>& lattice) const {
  for (int d = 0; d < Dim; ++d) {
    if (lattice.periodic(d)) continue;
    const auto &low = faces[2 * d], &high = faces[2 * d + 1];
    const int first = low.moves ? static_cast<int>(std::floor(lattice.scaled(d, low.plane))) : 0;
    const int last = high.moves ? static_cast<int>(std::ceil(lattice.scaled(d, high.plane))) : lattice.cells()[d];
    place[d] = std::max(first, std::min(place[d], last));
  }
  return place;
}

template <int Dim>
Vec<Dim> ContactSettings<Dim>::gradient_share(const double* sums, const Lattice<Dim>& lattice, double room) const {
  using N = NodeSums<Dim>;
  const double scale = options.normals == NormalSource::volume_gradient ? 1.0 : sums[N::volume] / sums[N::mass];
  return scale / room * Eigen::Map<const Vec<Dim>>(sums + N::gradient).cwiseProduct(lattice.spacing());
}

template <int Dim>
double ContactSettings<Dim>::distance(const double* sums, const Vec<Dim>& normal, const Lattice<Dim>& lattice,
                                      double room) const {
  const double volume = sums[NodeSums<Dim>::volume] / room;
  if (!(volume > 0)) return std::numeric_limits<double>::infinity();
  const Vec<Dim> gradient = gradient_share(sums, lattice, room);
  const double along = gradient.dot(normal);
  return contact::distance_beside_edge(volume, std::abs(along), (gradient - along * normal).norm());
}

template struct ContactSettings<2>;
template struct ContactSettings<3>;

}  // namespace cairn
