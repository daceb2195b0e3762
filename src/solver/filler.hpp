#pragma once
/// Points of bodies at the start, on a lattice in the cells.

#include <cmath>
#include <map>
#include <optional>

#include "cairn/body/cut_sites.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn {

/// State of a body under hydrostatic pressure [Pa]; without it, the reference state.
struct InitialState {
  double volume_ratio = 1;  // det F
  std::array<double, state_capacity> state{};

  InitialState() = default;
  InitialState(const Law& law, double pressure) {
    std::visit(
        [&](const auto& concrete) {
          if constexpr (HasPressure<std::remove_cvref_t<decltype(concrete)>>)
            if (pressure != 0) volume_ratio = concrete.pressurise(pressure, state.data());
        },
        law);
  }
};

/// Fills patches with the points of bodies: a square lattice of points in every cell, those inside the body's shape.
template <int Dim>
class Filler {
 public:
  Filler(const Case& c, const Lattice<Dim>& lattice, const std::vector<Body>& bodies,
         const std::vector<SolverMaterial>& materials)
      : case_(c),
        lattice_(lattice),
        bodies_(bodies),
        materials_(materials),
        per_direction_(static_cast<int>(std::lround(std::pow(c.solver.points_per_cell, 1.0 / Dim)))) {
    constexpr double direction[] = {1.0, 0.7549, 0.5698};  // along no face that goes through rows of points
    for (int d = 0; d < Dim; ++d) aside_[d] = 1e-7 * direction[d] * lattice.spacing()[d];
    for (int b = 0; b < static_cast<int>(c.bodies.size()); ++b)
      if (c.bodies[b].insert < 0) list_images(b);
  }

  /// Patches that the bounds of bodies reach, ascending.
  std::vector<PatchId> patches() const {
    std::vector<PatchId> all;
    for (const auto& [patch, bodies] : bodies_of_) all.push_back(patch);
    return all;
  }

  /// Calls f(body, position, share of a whole point's volume, image shift) for every point of the patch: by body, then
  /// by cell, then within the cell.
  template <class F>
  void for_points(PatchId patch, F&& f) const {
    const auto& reaching = bodies_of_.at(patch);
    for (const auto& placed : reaching) {
      const Shape& shape = case_.bodies[placed.body].shape;
      const Box<Dim> cells = intersection(placed.cells, lattice_.patch_cells(patch));
      Box<Dim> inside;
      inside.upper.fill(per_direction_);
      std::optional<CutSites<Dim>> cut;
      if (is_cut(shape)) cut.emplace(cut_sites(shape, placed.shift, cells));
      for_each(cells, [&](const Index<Dim>& cell) {
        for_each(inside, [&](const Index<Dim>& sub) {
          if (cut) {
            const PointSite site = cut->at(site_of(cell, sub));
            if (site.share > 0 && !is_held_already(reaching, placed, site.position + placed.shift))
              f(placed.body, site.position + placed.shift, site.share, placed.shift);
            return;
          }
          Vec3 x = Vec3::Zero();
          for (int d = 0; d < Dim; ++d)
            x[d] = lattice_.lower()[d] + (cell[d] + (sub[d] + 0.5) / per_direction_) * lattice_.spacing()[d];
          if (contains(shape, x - placed.shift + aside_) && !is_held_already(reaching, placed, x))
            f(placed.body, x, 1.0, placed.shift);
        });
      });
    }
  }

  /// Of a whole point [m^Dim].
  double point_volume() const { return lattice_.cell_volume() / std::pow(per_direction_, Dim); }

  /// Adds the points of the patch, and to the bodies' numbers what they begin with.
  void fill(Patch<Dim>& patch, std::int64_t first_id, int first_body = 0) const {
    using C = PointColumns<Dim>;
    const double volume = point_volume();
    int filled = -1;  // points come body by body
    InitialState initial;
    for_points(patch.id, [&](int b, const Vec3& x, double share, const Vec3& shift) {
      const Body& body = bodies_[b];
      const auto& spec = case_.bodies[b];
      auto& points =
          patch.piece_of(first_body + b, static_cast<int>(materials_[body.material].state_names.size())).points;
      const int p = points.size();
      points.resize(p + 1);
      const Vec3 omega = body.rigid ? body.angular_velocity : spec.angular_velocity;
      const Vec3 v = (body.rigid ? body.velocity : spec.velocity) + omega.cross(x - shift - body.centre);
      for (int c = 0; c < points.columns(); ++c) points.column(c)[p] = 0;
      const double pressure = spec.initial_pressure;
      if (b != filled) initial = InitialState(materials_[body.material].law, pressure), filled = b;
      for (int i = 0; i < 3; ++i) {
        points.column(C::deformation + tensor_index<Dim>(i, i))[p] = std::cbrt(initial.volume_ratio);
        points.column(C::stress + i)[p] = -pressure;
      }
      for (int c = C::state; c < points.columns(); ++c) points.column(c)[p] = initial.state[c - C::state];
      for (int s = 0; s < spin_size<Dim>; ++s) points.column(C::spin + s)[p] = omega[Dim == 2 ? 2 : s];
      Image image{};
      for (int d = 0; d < Dim; ++d) {
        points.column(d)[p] = x[d];
        points.column(C::velocity + d)[p] = v[d];
        image[d] = static_cast<std::int32_t>(-std::lround(shift[d] / lattice_.length(d)));
      }
      points.column(C::volume)[p] = share * volume / initial.volume_ratio;
      points.ids()[p] = first_id++;
      points.images()[p] = image;
    });
  }

 private:
  struct Placed {
    int body;
    Vec3 shift;      // of the image that reaches here
    Box<Dim> cells;  // that its bounds touch
  };

  /// Whether another image of the body holds a point and comes first: the body itself, then the images in their order.
  bool is_held_already(const std::vector<Placed>& reaching, const Placed& placed, const Vec3& x) const {
    if (placed.shift == Vec3::Zero()) return false;
    bool before = true;
    for (const Placed& other : reaching) {
      if (&other == &placed) before = false;
      if (other.body != placed.body || &other == &placed || (!before && other.shift != Vec3::Zero())) continue;
      if (contains(case_.bodies[other.body].shape, x - other.shift + aside_)) return true;
    }
    return false;
  }

  /// Whether points at the shape's surface are cut.
  bool is_cut(const Shape& shape) const {
    return case_.solver.surface == Surface::cut && can_be_cut(shape, lattice_.smallest_spacing(), per_direction_);
  }

  Index<Dim> site_of(const Index<Dim>& cell, const Index<Dim>& sub) const {
    Index<Dim> site;
    for (int d = 0; d < Dim; ++d) site[d] = cell[d] * per_direction_ + sub[d];
    return site;
  }

  CutSites<Dim> cut_sites(const Shape& shape, const Vec3& shift, const Box<Dim>& cells) const {
    Vec3 origin = -shift, spacing = Vec3::Zero();
    for (int d = 0; d < Dim; ++d) origin[d] += lattice_.lower()[d], spacing[d] = lattice_.spacing()[d] / per_direction_;
    return {shape, origin, spacing, {site_of(cells.lower, {}), site_of(cells.upper, {})}};
  }

  /// Lists the patches that a body and its periodic images touch.
  void list_images(int b) {
    const Bounds all = bounds(case_.bodies[b].shape);
    Box<Dim> images;
    for (int d = 0; d < Dim; ++d) {
      const double length = lattice_.length(d);
      images.upper[d] = 1;
      // What has no end along a periodic direction is the same in every period: once is enough.
      if (!lattice_.periodic(d) || !std::isfinite(all.lower[d]) || !std::isfinite(all.upper[d])) continue;
      images.lower[d] = static_cast<int>(std::floor((lattice_.lower()[d] - all.upper[d]) / length));
      images.upper[d] = static_cast<int>(std::ceil((lattice_.upper()[d] - all.lower[d]) / length)) + 1;
    }
    for_each(images, [&](const Index<Dim>& image) {
      Placed placed{b, Vec3::Zero(), {}};
      for (int d = 0; d < Dim; ++d) {
        placed.shift[d] = image[d] * lattice_.length(d);
        const double low = lattice_.scaled(d, all.lower[d] + placed.shift[d]),
                     high = lattice_.scaled(d, all.upper[d] + placed.shift[d]);
        placed.cells.lower[d] = static_cast<int>(std::floor(std::clamp(low, 0.0, double(lattice_.cells()[d]))));
        placed.cells.upper[d] = static_cast<int>(std::ceil(std::clamp(high, 0.0, double(lattice_.cells()[d]))));
      }
      if (placed.cells.empty()) return;
      Index<Dim> last = placed.cells.upper;
      for (auto& i : last) --i;
      const auto from = lattice_.patch_position(lattice_.patch_of_cell(placed.cells.lower));
      auto to = lattice_.patch_position(lattice_.patch_of_cell(last));
      for (auto& i : to) ++i;
      for_each(Box<Dim>{from, to},
               [&](const Index<Dim>& position) { bodies_of_[lattice_.patch_at(position)].push_back(placed); });
    });
  }

  Vec3 aside_ = Vec3::Zero();  // added to the points: one on a face that two bodies share goes to one of them
  const Case& case_;
  const Lattice<Dim>& lattice_;
  const std::vector<Body>& bodies_;
  const std::vector<SolverMaterial>& materials_;
  int per_direction_;
  std::map<PatchId, std::vector<Placed>> bodies_of_;  // ascending in body
};

}  // namespace cairn
