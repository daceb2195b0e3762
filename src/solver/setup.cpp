#include "setup.hpp"

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
#include "filler.hpp"
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

/// Says which bodies got more or less mass than their shapes have. `placed`: whole points of each.
std::vector<std::string> mass_warnings(const Case& c, const std::vector<double>& placed, double point_volume) {
  constexpr double tolerated = 0.05;
  constexpr std::size_t most = 5;  // said one by one
  const int samples = samples_for(c.bodies.size(), c.domain.dimension);
  std::vector<std::string> warnings;
  std::size_t others = 0;
  for (std::size_t b = 0; b < placed.size(); ++b) {
    if (c.bodies[b].insert >= 0) continue;
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
    if (points_of_body[b] == 0 && c.bodies[b].insert < 0 && errors.size() < 20)
      errors.push_back(
          fmt::format("{}: body {} holds no material point: it is smaller than the spacing of the points or lies "
                      "outside the domain; use smaller cells or more points per cell",
                      c.bodies[b].source, b));
  if (!errors.empty()) throw InputError(errors);
}

}  // namespace

template <int Dim>
FaceConditions<Dim> make_faces(const Case& c) {
  FaceConditions<Dim> faces;
  for (int f = 0; f < 2 * Dim; ++f) {
    const Face& face = c.faces[f];
    faces[f].type = c.domain.periodic[f / 2] ? FaceType::periodic : face.type;
    faces[f].velocity = head<Dim>(face.velocity.at(0)), faces[f].leaving = face.leaving;
    faces[f].moves = moves(face, f);
    for (const RunStage& stage : c.stages) faces[f].moves = faces[f].moves || moves(stage.changed->faces[f], f);
    faces[f].friction.assign(c.materials.size(), {ContactLaw::friction, face.friction});
    for (const auto& pair : c.contact.pairs) {
      const int material = std::max(pair.material_a, pair.material_b);
      if (std::min(pair.material_a, pair.material_b) != -1 || material < 0) continue;
      faces[f].friction[material] = {pair.law, pair.law == ContactLaw::frictionless ? 0.0 : pair.friction};
    }
  }
  return faces;
}

template <int Dim>
Simulation<Dim>::Simulation(const Case& c, MPI_Comm comm, const Checkpoint* from)
    : comm_(comm),
      solver_(c.solver),
      schedule_(schedule_of(c.solver.stress_update)),
      parallel_(c.parallel),
      limits_(c.time),
      lattice_(make_lattice<Dim>(c.domain)),
      transfer_(TransferSettings<Dim>::make(c.solver, c.contact, head<Dim>(c.domain.gravity.at(0)))) {
  MPI_Comm_rank(comm_, &rank_);
  MPI_Comm_size(comm_, &ranks_);
  std::vector<ContactMaterial> contact_materials;
  for (const auto& spec : c.materials) {
    materials_.push_back(make_material(spec));
    const double modulus = materials_.back().longitudinal_modulus, speed = std::sqrt(modulus / spec.density);
    contact_materials.push_back({modulus, speed});
  }
  contact_ = ContactSettings<Dim>::make(c.contact, contact_materials, make_faces<Dim>(c));
  contact_.chords = c.solver.stress_update == StressUpdate::both;
  bodies_ = make_bodies(c, materials_);
  contact_.bodies = static_cast<int>(bodies_.size());
  tools_ = make_tools(c, bodies_);
  keep_what_is_asked(c);
  speeds_.wave = first_step(c).wave_speed;
  for (int d = 0; d < Dim; ++d)
    for (int side = 0; side < 2; ++side) {
      const FaceType type = contact_.faces[2 * d + side].type;
      transfer_.mirrored[d][side] = type == FaceType::symmetry, transfer_.walled[d][side] = type == FaceType::wall;
    }
  const bool walls = std::ranges::any_of(contact_.faces, [](const auto& f) { return f.type == FaceType::wall; });
  const bool several = bodies_.size() > 1 || c.crack.split > 0;
  transfer_.normals_needed = walls || (several && transfer_.normals_needed);  // something to touch
  if (solver_.shape == ShapeFunction::cpdi)
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      transfer_.stretch.push_back(
          std::cbrt(InitialState(materials_[bodies_[b].material].law, c.bodies[b].initial_pressure).volume_ratio));
  define_cracks(c);
  define_pouring(c);
  transfer_of_turning_ = transfer_;
  transfer_of_turning_.spin = true;
  gravity_ = c.domain.gravity, damping_ = c.damping, deformation_ = c.domain.deformation;
  place_walls();
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
  place_corner(head<Dim>(from.state().step.upper));
  needed_rates_ = from.state().step.needed_rates;
  make_patches(filled, points, from.patches());
  restore_cracks(from.state().cracks);
  restore_parts(from.state().parts, from.state().spared);
  from.fill(patches_, lattice_, bodies_, materials_, cracks_);
  check_bonds();
  connect_patches();
  receive_cracks();
  const StepState& state = from.state().step;
  time_ = state.time, dt_ = state.dt, steps_ = state.steps, kinetic_ = state.kinetic;
  restore_tools(from.state().tools);
  restore_pouring(from.state().pouring);
  transfer_.gravity = head<Dim>(gravity_.at(time_)), transfer_of_turning_.gravity = transfer_.gravity;
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
    for (auto& piece : patch->pieces) piece.points.shrink_to_fit();
  }
  next_id_ = total_points_;
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

template FaceConditions<2> make_faces(const Case&);
template FaceConditions<3> make_faces(const Case&);
template Simulation<2>::Simulation(const Case&, MPI_Comm, const Checkpoint*);
template Simulation<3>::Simulation(const Case&, MPI_Comm, const Checkpoint*);

}  // namespace cairn
