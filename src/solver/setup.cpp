#include <fmt/format.h>

#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "cairn/body/cut_sites.hpp"
#include "cairn/core/error.hpp"
#include "cairn/io/first_step.hpp"
#include "cairn/parallel/distribution.hpp"
#include "cairn/solver/checkpoint.hpp"
#include "cairn/solver/simulation.hpp"
#include "cairn/solver/volume.hpp"
#include "memory.hpp"

namespace cairn {
namespace {

template <int Dim>
Vec<Dim> head(const Vec3& v) {
  return v.head<Dim>();
}

template <int Dim>
Lattice<Dim> make_lattice(const Domain& domain) {
  Index<Dim> cells;
  std::array<bool, Dim> periodic;
  for (int d = 0; d < Dim; ++d) cells[d] = domain.cells[d], periodic[d] = domain.periodic[d];
  return Lattice<Dim>(head<Dim>(domain.lower), head<Dim>(domain.upper), cells, periodic, domain.patch_cells);
}

SolverMaterial make_material(const Material& spec) {
  SolverMaterial m{spec.name, make_law(spec.model, spec.parameters, spec.plane), spec.density, false, 0.0, {}};
  m.longitudinal_modulus = longitudinal_modulus(m.law);
  std::visit(
      [&](const auto& law) {
        m.rigid = law.rigid;
        m.state_names.assign(law.state_names.begin(), law.state_names.end());
      },
      m.law);
  return m;
}

std::vector<Body> make_bodies(const Case& c, const std::vector<SolverMaterial>& materials) {
  std::vector<Body> bodies;
  for (const auto& spec : c.bodies)
    bodies.push_back(
        {spec.material, materials[spec.material].rigid, spec.velocity, spec.angular_velocity, centre(spec.shape)});
  for (const auto& drive : c.drives) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      if (!selects(drive, c.bodies[b], static_cast<int>(b), c.domain)) continue;
      bodies[b].rigid = true;
      bodies[b].velocity = drive.velocity.at(0);
      bodies[b].angular_velocity = drive.angular_velocity.at(0);
    }
  }
  return bodies;
}

template <int Dim>
FaceConditions<Dim> make_faces(const Case& c) {
  FaceConditions<Dim> faces;
  for (int f = 0; f < 2 * Dim; ++f) {
    const Face& face = c.faces[f];
    faces[f].type = c.domain.periodic[f / 2] ? FaceType::periodic : face.type;
    faces[f].velocity = head<Dim>(face.velocity), faces[f].leaving = face.leaving;
    faces[f].friction.assign(c.materials.size(), {ContactLaw::friction, face.friction});
    for (const auto& pair : c.contact.pairs) {
      const int material = std::max(pair.material_a, pair.material_b);
      if (std::min(pair.material_a, pair.material_b) != -1 || material < 0) continue;
      faces[f].friction[material] = {pair.law, pair.law == ContactLaw::frictionless ? 0.0 : pair.friction};
    }
  }
  return faces;
}

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
    for (int b = 0; b < static_cast<int>(c.bodies.size()); ++b) list_images(b);
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

  void fill(Patch<Dim>& patch, std::int64_t first_id) const {
    using C = PointColumns<Dim>;
    const double volume = point_volume();
    int filled = -1;  // points come body by body
    InitialState initial;
    for_points(patch.id, [&](int b, const Vec3& x, double share, const Vec3& shift) {
      const Body& body = bodies_[b];
      const auto& spec = case_.bodies[b];
      auto& points = patch.piece_of(b, static_cast<int>(materials_[body.material].state_names.size())).points;
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
    for (auto& piece : patch.pieces) piece.points.shrink_to_fit();
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

/// Says which bodies got more or less mass than their shapes have. `placed`: whole points of each.
std::vector<std::string> mass_warnings(const Case& c, const std::vector<double>& placed, double point_volume) {
  constexpr double tolerated = 0.05;
  constexpr std::size_t most = 5;  // said one by one
  const int samples = samples_for(c.bodies.size(), c.domain.dimension);
  std::vector<std::string> warnings;
  std::size_t others = 0;
  for (std::size_t b = 0; b < placed.size(); ++b) {
    const double density = c.materials[c.bodies[b].material].density;
    const double mass = density * placed[b] * point_volume,
                 whole = density * volume_of(c.bodies[b].shape, c.domain, samples);
    if (std::abs(mass - whole) <= tolerated * whole) continue;
    if (warnings.size() == most) {
      ++others;
      continue;
    }
    warnings.push_back(fmt::format(
        "{}: the points of body {} have {:.4g} kg, density x volume of its shape is {:.4g} kg ({:+.1f} %); use smaller "
        "cells, or sizes that are whole numbers of points",
        c.bodies[b].source, b, mass, whole, 100 * (mass / whole - 1)));
  }
  if (others > 0)
    warnings.push_back(fmt::format("the masses of {} more bodies differ from their shapes' by more than {:.0f} %",
                                   others, 100 * tolerated));
  return warnings;
}

/// \throws InputError on every rank where a body got no point at all
void check_bodies(const Case& c, std::vector<std::int64_t>& points_of_body, MPI_Comm comm) {
  MPI_Allreduce(MPI_IN_PLACE, points_of_body.data(), static_cast<int>(points_of_body.size()), MPI_INT64_T, MPI_SUM,
                comm);
  std::vector<std::string> errors;
  for (std::size_t b = 0; b < points_of_body.size(); ++b)
    if (points_of_body[b] == 0 && errors.size() < 20)
      errors.push_back(
          fmt::format("{}: body {} holds no material point: it is smaller than the spacing of the points or lies "
                      "outside the domain; use smaller cells or more points per cell",
                      c.bodies[b].source, b));
  if (!errors.empty()) throw InputError(errors);
}

}  // namespace

template <int Dim>
Simulation<Dim>::Simulation(const Case& c, MPI_Comm comm, const Checkpoint* from)
    : comm_(comm),
      solver_(c.solver),
      parallel_(c.parallel),
      limits_(c.time),
      lattice_(make_lattice<Dim>(c.domain)),
      transfer_(TransferSettings<Dim>::make(c.solver, c.contact, head<Dim>(c.domain.gravity))) {
  MPI_Comm_rank(comm_, &rank_);
  MPI_Comm_size(comm_, &ranks_);
  std::vector<ContactMaterial> contact_materials;
  for (const auto& spec : c.materials) {
    materials_.push_back(make_material(spec));
    const double modulus = materials_.back().longitudinal_modulus, speed = std::sqrt(modulus / spec.density);
    contact_materials.push_back({modulus, speed});
  }
  contact_ = ContactSettings<Dim>::make(c.contact, contact_materials, make_faces<Dim>(c));
  contact_.keep_contacts = c.output.grains.active() || c.output.contacts.active();
  contact_.chords = c.solver.stress_update == StressUpdate::both;
  bodies_ = make_bodies(c, materials_);
  tools_ = make_tools(c, bodies_);
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    if (bodies_[b].tool >= 0 && tools_[bodies_[b].tool].moves()) moved_bodies_.push_back(static_cast<int>(b));
  has_pistons_ = std::ranges::any_of(tools_, [](const Tool& tool) { return tool.piston.mass > 0; });
  contact_.keep_tools = c.output.forces.active() || has_pistons_;
  speeds_.wave = first_step(c).wave_speed;
  for (int d = 0; d < Dim; ++d)
    for (int side = 0; side < 2; ++side) {
      const FaceType type = contact_.faces[2 * d + side].type;
      transfer_.mirrored[d][side] = type == FaceType::symmetry, transfer_.walled[d][side] = type == FaceType::wall;
    }
  const bool walls = std::ranges::any_of(contact_.faces, [](const auto& f) { return f.type == FaceType::wall; });
  transfer_.normals_needed = walls || (bodies_.size() > 1 && transfer_.normals_needed);  // something to touch
  if (solver_.shape == ShapeFunction::cpdi)
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      transfer_.stretch.push_back(
          std::cbrt(InitialState(materials_[bodies_[b].material].law, c.bodies[b].initial_pressure).volume_ratio));
  define_cracks(c);
  transfer_of_turning_ = transfer_;
  transfer_of_turning_.spin = true;
  if (from)
    restore(*from);
  else
    place_points(c);
  // As at the end of a step; and the memory of the nodes is there before the first step.
  for (auto& patch : patches_)
    for (auto& piece : patch.pieces) project_ahead(patch, piece);
}

template <int Dim>
void Simulation<Dim>::make_patches(const std::vector<PatchId>& filled, const std::vector<std::int64_t>& points,
                                   const std::vector<PatchId>& kept) {
  total_points_ = std::accumulate(points.begin(), points.end(), std::int64_t{0});
  table_ = PatchTable<Dim>(lattice_, filled, kept);
  std::vector<std::int64_t> work(table_.size(), 0);
  for (std::size_t p = 0; p < filled.size(); ++p) work[table_.find(filled[p])] = points[p];
  table_.assign(distribute_patches(lattice_, table_.patches(), work, ranks_, parallel_.partition));
  std::int64_t mine = 0;
  for (std::size_t p = 0; p < filled.size(); ++p)
    if (table_.owner(filled[p]) == rank_) mine += points[p];
  require_memory(estimated_memory<Dim>(mine, solver_, transfer_.extras), comm_);
  for (const PatchId patch : table_.patches())
    if (table_.owner(patch) == rank_) patches_.emplace_back(patch, lattice_);
}

template <int Dim>
void Simulation<Dim>::restore(const Checkpoint& from) {
  from.check_layout(lattice_);
  std::vector<PatchId> filled;
  std::vector<std::int64_t> points;
  for (std::size_t p = 0; p < from.patches().size(); ++p)
    if (from.points()[p] > 0) filled.push_back(from.patches()[p]), points.push_back(from.points()[p]);
  make_patches(filled, points, from.patches());
  from.fill(patches_, lattice_, bodies_, materials_, cracks_);
  connect_patches();
  receive_cracks();
  const StepState& state = from.state().step;
  time_ = state.time, dt_ = state.dt, steps_ = state.steps;
  restore_tools(from.state().tools);
  maxima_[0] = state.wave_speed, maxima_[1] = state.point_speed;
  speeds_ = {};
}

template <int Dim>
void Simulation<Dim>::place_points(const Case& c) {
  // Each rank counts the points of some patches; then every rank knows all counts and deals the patches out alike.
  const Filler<Dim> filler(c, lattice_, bodies_, materials_);
  const std::vector<PatchId> reached = filler.patches();
  std::vector<std::int64_t> count(reached.size(), 0), of_body(bodies_.size(), 0);
  std::vector<double> volume(bodies_.size(), 0);  // placed, in whole points
  for (std::size_t p = rank_; p < reached.size(); p += ranks_)
    filler.for_points(reached[p], [&](int body, const Vec3&, double share, const Vec3&) {
      ++count[p], ++of_body[body], volume[body] += share;
    });
  MPI_Allreduce(MPI_IN_PLACE, count.data(), static_cast<int>(count.size()), MPI_INT64_T, MPI_SUM, comm_);
  check_bodies(c, of_body, comm_);
  MPI_Allreduce(MPI_IN_PLACE, volume.data(), static_cast<int>(volume.size()), MPI_DOUBLE, MPI_SUM, comm_);
  if (rank_ == 0) warnings_ = mass_warnings(c, volume, filler.point_volume());
  std::vector<PatchId> filled;
  std::vector<std::int64_t> points;
  for (std::size_t p = 0; p < reached.size(); ++p)
    if (count[p] > 0) filled.push_back(reached[p]), points.push_back(count[p]);
  make_patches(filled, points, patches_of_cracks(c));

  std::int64_t first_id = 0;
  auto patch = patches_.begin();
  for (std::size_t p = 0; p < filled.size(); first_id += points[p], ++p) {
    if (table_.owner(filled[p]) != rank_) continue;
    while (patch->id != filled[p]) ++patch;
    filler.fill(*patch, first_id);
  }
  connect_patches();
  place_cracks(c);

  using C = PointColumns<Dim>;
  for (auto& patch : patches_)
    for (const auto& piece : patch.pieces) {
      const auto inertia = spin_inertia(piece, lattice_, transfer_);
      for (int p = 0; p < piece.points.size(); ++p) {
        double squared = 0, spin = 0;
        for (int d = 0; d < Dim; ++d) squared += std::pow(piece.points.column(C::velocity + d)[p], 2);
        for (int s = 0; s < spin_size<Dim>; ++s)
          spin += inertia[p][s] * std::pow(piece.points.column(C::spin + s)[p], 2);
        speeds_.point = std::max(speeds_.point, std::sqrt(squared));
        if (!is_rigid(piece))
          patch.ledger.blended_and_spun += 0.5 * material_of(piece).density * piece.points.column(C::volume)[p] * spin;
      }
    }
  start_speed_reduction();
}

template Simulation<2>::Simulation(const Case&, MPI_Comm, const Checkpoint*);
template Simulation<3>::Simulation(const Case&, MPI_Comm, const Checkpoint*);

}  // namespace cairn
