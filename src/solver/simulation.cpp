#include "cairn/solver/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "cairn/core/error.hpp"
#include "cairn/io/agreement.hpp"
#include "cairn/parallel/balance.hpp"
#include "fault.hpp"
#include "point_budget.hpp"

namespace cairn {
namespace {

constexpr int all_columns = std::numeric_limits<int>::max();

/// Columns [first, last) of the points.
struct ColumnRange {
  int first, last;
};

/// Calls f(piece) for every piece of a patch. The columns named, those that f uses, are fetched a piece ahead.
template <int Dim, class F>
void for_pieces(Patch<Dim>& patch, std::initializer_list<ColumnRange> columns, F&& f) {
  const auto fetch_points = [&](const Points<Dim>& points) {
    for (const auto& [first, last] : columns) points.fetch(first, std::min(last, points.columns()));
  };
  for (std::size_t k = 0; k < patch.pieces.size(); ++k) {
    if (k + 1 < patch.pieces.size()) fetch_points(patch.pieces[k + 1].points);
    f(patch.pieces[k]);
  }
}

/// Fetches what contact and integration read of the nodes.
template <int Dim>
void fetch_nodes(const Patch<Dim>& patch) {
  for (const auto& piece : patch.pieces) {
    fetch(piece.nodes.sums.data(), piece.nodes.sums.size());
    fetch(piece.nodes.force.data(), piece.nodes.force.size());
  }
}

/// Points are sorted by cell again after so many steps.
constexpr std::int64_t sort_interval = 50;

}  // namespace

template <int Dim>
void Simulation<Dim>::step(double longest) {
  using P = Patch<Dim>;
  const StressUpdate update = solver_.stress_update;
  const bool first = update == StressUpdate::first || update == StressUpdate::both;
  const bool again = projects_again();
  const double share = update == StressUpdate::both ? 0.5 : 1.0;

  choose_time_step(longest);
  begin_tools();
  filter_noise();
  exchange_->begin_sums(transfer_.extras);
  exchange_after([&](std::size_t, P& patch) { project_points(patch); });
  if (first) {
    exchange_->begin(&NodeBox<Dim>::force);
    exchange_after([&](std::size_t p, P& patch) {
      contact_before_update(p, patch);
      strain_first(patch, share);
    });
    look_for_fault(2);
  }
  const auto update_momentum = [&](std::size_t p, P& patch) {
    first ? complete_forces(p, patch) : contact_before_update(p, patch);
    contact_after_update(p, patch, !again);
  };
  if (again) {
    exchange_->begin(&NodeBox<Dim>::velocity);
    exchange_after([&](std::size_t p, P& patch) {
      update_momentum(p, patch);
      accelerate_points(patch);
    });
    push_pistons();
  }
  migrate_after([&](std::size_t p, P& patch) {
    again ? project_again(p, patch) : update_momentum(p, patch);
    finish_points(patch, share);
  });
  look_for_fault(1);
  receive_points();
  end_tools();
  time_ += dt_;
  ++steps_;
  if (parallel_.balance_every > 0 && steps_ % parallel_.balance_every == 0) balance();
}

template <int Dim>
void Simulation<Dim>::choose_time_step(double longest) {
  finish_speed_reduction();
  const double cell = lattice_.smallest_spacing(), speed = maxima_[0] + maxima_[1];
  if (limits_.dt * speed > cell)
    throw RunError(fmt::format(
        "step {}: time.dt = {:.6g} s is longer than a wave or point takes through a cell, {:.6g} s (wave speed {:.6g} "
        "m/s, point speed {:.6g} m/s); give a smaller time.dt, or leave it to time.cfl",
        steps_ + 1, limits_.dt, cell / speed, maxima_[0], maxima_[1]));
  if (speed > 0 || dt_ == 0) dt_ = limits_.dt > 0 ? limits_.dt : limits_.cfl * cell / speed;  // else no point is left
  if (!(dt_ > 0) || !std::isfinite(dt_))
    throw RunError(fmt::format("step {}: the time step collapsed (wave speed {} m/s, point speed {} m/s)", steps_ + 1,
                               maxima_[0], maxima_[1]));
  // Reach the end exactly, without a last step of a rounding error's length.
  if (dt_ * (1 + 1e-9) >= longest) dt_ = longest;
}

template <int Dim>
void Simulation<Dim>::project_points(Patch<Dim>& patch) {
  const auto time = timers_.measure(Stage::project);
  find_cracks(patch);
  for (auto& piece : patch.pieces)
    if (!std::exchange(piece.projected, false)) project_piece(patch, piece);
}

/// The node box, and the rows of the sides of cracks.
template <int Dim>
void Simulation<Dim>::lay_out(Patch<Dim>& patch, Piece<Dim>& piece) {
  lay_out_nodes(piece, lattice_, transfer_);
  if (!patch.cracks.empty() && !is_rigid(piece)) find_sides(piece, segments_of(patch), cracks_, lattice_);
}

template <int Dim>
void Simulation<Dim>::project_piece(Patch<Dim>& patch, Piece<Dim>& piece) {
  lay_out(patch, piece);
  project(piece, lattice_, transfer_of(piece), material_of(piece).density);
}

/// Projects a piece for the step that comes next, unless there are cracks whose places then are not known yet.
template <int Dim>
void Simulation<Dim>::project_ahead(Patch<Dim>& patch, Piece<Dim>& piece) {
  if (!patch.cracks.empty()) return;
  const auto time = timers_.measure(Stage::project);
  project_piece(patch, piece);
  piece.projected = true;
}

template <int Dim>
void Simulation<Dim>::contact_before_update(std::size_t p, Patch<Dim>& patch) {
  {
    const auto time = timers_.measure(Stage::exchange);
    fetch_nodes(patch);
    exchange_->add(patch, p);
    mirror_sums(patch, lattice_, contact_.faces);
  }
  const auto time = timers_.measure(Stage::contact);
  sweeps_[p].find(patch, lattice_, contact_, bodies_);
  sweeps_[p].first_pass(patch, lattice_, contact_, dt_);
}

template <int Dim>
void Simulation<Dim>::strain_first(Patch<Dim>& patch, double share) {
  using C = PointColumns<Dim>;
  const auto time = timers_.measure(Stage::stress);
  for (auto& piece : patch.pieces) {
    velocities_.lend(piece.nodes.velocity);
    velocity_from_sums(piece);
  }
  constrain_velocity(patch, lattice_, contact_.faces, bodies_, false);
  for_pieces(patch, {{C::position, C::velocity}, {C::deformation, all_columns}}, [&](Piece<Dim>& piece) {
    const auto& material = material_of(piece);
    if (is_rigid(piece))
      std::fill(piece.nodes.force.begin(), piece.nodes.force.end(), 0.0);
    else
      update_guarded(piece, [&](double part, SpeedLimits& speeds) {
        update_stress_and_force(piece, lattice_, transfer_, material.law, material.density, part * share * dt_, speeds);
      });
    if (!projects_again()) velocities_.take_back(piece.nodes.velocity);
  });
}

template <int Dim>
void Simulation<Dim>::complete_forces(std::size_t p, Patch<Dim>& patch) {
  const auto time = timers_.measure(Stage::exchange);
  fetch_nodes(patch);
  exchange_->add(patch, p);
  mirror_vectors(patch, lattice_, contact_.faces, &NodeBox<Dim>::force);
}

template <int Dim>
void Simulation<Dim>::contact_after_update(std::size_t p, Patch<Dim>& patch, bool last) {
  {
    const auto time = timers_.measure(Stage::contact);
    sweeps_[p].second_pass(patch, lattice_, contact_, dt_, last);
  }
  const auto time = timers_.measure(Stage::integrate);
  for (auto& piece : patch.pieces) {
    motions_.lend(piece.nodes.motion);
    integrate(piece, dt_);
  }
  constrain_motion(patch, lattice_, contact_.faces, bodies_, dt_, last, contact_.keep_tools);
}

template <int Dim>
void Simulation<Dim>::accelerate_points(Patch<Dim>& patch) {
  using C = PointColumns<Dim>;
  const auto time = timers_.measure(Stage::update);
  for_pieces(patch, {{C::position, C::deformation}, {C::volume, C::state}}, [&](Piece<Dim>& piece) {
    const double density = material_of(piece).density;
    if (is_rigid(piece))
      project_momentum(piece, lattice_, transfer_of(piece), density);
    else
      patch.ledger.blended_and_spun += accelerate_and_project(piece, lattice_, transfer_, density, dt_);
  });
}

template <int Dim>
void Simulation<Dim>::project_again(std::size_t p, Patch<Dim>& patch) {
  {
    const auto time = timers_.measure(Stage::exchange);
    exchange_->add(patch, p);
    mirror_vectors(patch, lattice_, contact_.faces, &NodeBox<Dim>::velocity);
  }
  const auto time = timers_.measure(Stage::contact);
  sweeps_[p].repeat_pass(patch, lattice_, contact_, dt_);
  for (auto& piece : patch.pieces) velocity_from_momentum(piece);
  constrain_velocity(patch, lattice_, contact_.faces, bodies_, true);
  for (auto& piece : patch.pieces) centre_motion(piece);
}

/// The last pass over the points: what is left to do with them, and they move. Those that left the patch are taken out;
/// a piece that kept all of its points is projected for the next step at once, while they are in the cache.
template <int Dim>
void Simulation<Dim>::finish_points(Patch<Dim>& patch, double share) {
  using C = PointColumns<Dim>;
  const bool strained = solver_.stress_update == StressUpdate::first;
  if (!patch.cracks.empty())
    face_motions_[&patch - patches_.data()] = find_face_velocities(patch.cracks, surroundings_of(patch));
  const auto time = timers_.measure(strained ? Stage::update : Stage::stress);
  for_pieces(patch, {{C::position, strained ? C::state : all_columns}}, [&](Piece<Dim>& piece) {
    finish_piece(patch, piece, share);
    patch.ledger.stopped += static_cast<double>(std::exchange(speeds_.stopped, 0));
    if (!projects_again()) motions_.take_back(piece.nodes.motion), velocities_.take_back(piece.nodes.velocity);
    if (!marked_ && all_inside(piece, lattice_, patch.id)) {
      project_ahead(patch, piece);
    } else {
      const auto time = timers_.measure(Stage::migrate);
      migration_->collect(patch, piece, lattice_);
    }
  });
}

template <int Dim>
void Simulation<Dim>::finish_piece(Patch<Dim>& patch, Piece<Dim>& piece, double share) {
  const auto& material = material_of(piece);
  double& lost = patch.ledger.blended_and_spun;
  if (is_rigid(piece)) {
    turn_stress(piece);
    move_rigid(piece);
    return;
  }
  if (solver_.stress_update == StressUpdate::first) {
    lost += accelerate_and_move(piece, lattice_, transfer_, material.density, dt_, speeds_);
    return;
  }
  if (solver_.stress_update == StressUpdate::last) {
    lost += accelerate(piece, lattice_, transfer_, material.density, dt_);
    velocities_.lend(piece.nodes.velocity);
    velocity_from_motion(piece);
  }
  update_guarded(piece, [&](double part, SpeedLimits& speeds) {
    update_stress_and_move(piece, lattice_, transfer_, material.law, material.density, part * share * dt_, part * dt_,
                           speeds);
  });
}

/// The stress of a driven body turns with it: its nodes have the velocity of the rigid motion, whose gradient is its
/// spin.
template <int Dim>
void Simulation<Dim>::turn_stress(Piece<Dim>& piece) {
  const auto& material = material_of(piece);
  if (material.rigid || !turns_rigidly(piece)) return;
  velocities_.lend(piece.nodes.velocity);
  velocity_from_sums(piece);
  SpeedLimits unlimited;  // no wave runs through it
  update_stress(piece, lattice_, transfer_, material.law, material.density, dt_, unlimited);
  if (!std::isfinite(unlimited.wave)) speeds_.wave = unlimited.wave;
}

/// Points of a rigid body turn about its centre, which travels with its tool.
template <int Dim>
void Simulation<Dim>::move_rigid(Piece<Dim>& piece) {
  using C = PointColumns<Dim>;
  const Body& body = bodies_[piece.body];
  const Tool& tool = tools_[body.tool];
  Points<Dim>& points = piece.points;
  const Vec3 spin = tool.spin_of_step(), way = dt_ * tool.of_step(), centre = body.centre + tool.travel;
  const double speed = spin.norm();
  const Vec3 axis = speed > 0 ? Vec3(spin / speed) : Vec3::UnitZ();
  const Mat3 turn = Eigen::AngleAxisd(speed * dt_, axis).toRotationMatrix();
  for (int p = 0; p < points.size(); ++p) {
    Vec3 arm = Vec3::Zero();
    for (int d = 0; d < Dim; ++d) arm[d] = points.column(d)[p] + points.images()[p][d] * lattice_.length(d) - centre[d];
    const Vec3 turned = speed > 0 ? Vec3(turn * arm) : arm;
    const Vec3 velocity = tool.next + tool.spin_next.cross(turned);
    for (int d = 0; d < Dim; ++d) {
      points.column(d)[p] += way[d] + turned[d] - arm[d];
      points.column(C::velocity + d)[p] = velocity[d];
    }
    for (int s = 0; s < spin_size<Dim>; ++s) points.column(C::spin + s)[p] = tool.spin_next[Dim == 2 ? 2 : s];
    speeds_.point = std::max(speeds_.point, velocity.norm());
  }
}

template <int Dim>
void Simulation<Dim>::receive_points() {
  const auto time = timers_.measure(Stage::migrate);
  start_speed_reduction();
  migration_->finish(patches_);
  marked_ = false;
  move_cracks();
  if ((steps_ + 1) % sort_interval == 0)
    for (auto& patch : patches_)
      for (auto& piece : patch.pieces) sort_by_cell(piece, lattice_, patch.cells);
}

/// Notes which point a stage found to be inverted or not finite. What it did to others in later stages does not matter:
/// the most urgent fault of all ranks is the one reported, that of the earliest stage.
template <int Dim>
void Simulation<Dim>::look_for_fault(int urgency) {
  if (fault_urgency_ > 0 || (std::isfinite(speeds_.wave) && std::isfinite(speeds_.point))) return;
  const Fault fault = find_fault(patches_, bodies_);
  fault_urgency_ = 10 * urgency + fault.kind;
  fault_ = fault.text;
}

/// They take part in the rest of the step as mass without stress, and leave at its end.
template <int Dim>
void Simulation<Dim>::mark_faults(Piece<Dim>& piece) {
  using C = PointColumns<Dim>;
  Points<Dim>& points = piece.points;
  for (int p = 0; p < points.size(); ++p) {
    if (is_lost(points.ids()[p])) continue;
    const Fault fault = fault_of(points, p, piece.body);
    if (fault.kind == Fault::none) continue;
    notes_.push_back(fmt::format("step {}: {}; it is dropped", steps_ + 1, fault.text));
    marked_ = true;
    mark_lost(points.ids()[p]);
    for (int d = 0; d < Dim; ++d) {
      if (!std::isfinite(points.column(d)[p]))
        points.column(d)[p] = lattice_.node_position(d, piece.nodes.box.lower[d] + 1);
      if (!std::isfinite(points.column(C::velocity + d)[p])) points.column(C::velocity + d)[p] = 0;
    }
    for (int c = C::spin; c < C::volume; ++c) points.column(c)[p] = 0;
    for (int i = 0; i < 3; ++i) points.column(C::deformation + tensor_index<Dim>(i, i))[p] = 1;
    for (int c = C::state; c < points.columns(); ++c)
      if (!std::isfinite(points.column(c)[p])) points.column(c)[p] = 0;
  }
}

template <int Dim>
void Simulation<Dim>::book_departures(Patch<Dim>& patch, const Piece<Dim>& piece,
                                      std::span<const Departure> departing) {
  PatchLedger& ledger = patch.ledger;
  for (const auto& [point, lost] : departing) {
    ++(lost.empty() ? ledger.points_left : ledger.points_lost);
    if (!lost.empty() && !is_lost(piece.points.ids()[point]))
      notes_.push_back(fmt::format("step {}: {}; it is dropped", steps_ + 1, lost));
  }
  for_budgets(
      piece, material_of(piece), is_rigid(piece), lattice_, transfer_, static_cast<int>(departing.size()),
      [&](int i) { return departing[i].point; },
      [&](int, const PointBudget& b) {
        ledger.mass_left += b.mass;
        if (!std::isfinite(b.energy())) return;  // no number to book
        ledger.energy_left += b.energy();
        ledger.blended_and_spun -= b.spin;
        ledger.momentum_left_x += b.momentum[0], ledger.momentum_left_y += b.momentum[1];
        ledger.momentum_left_z += b.momentum[2];
      });
}

template <int Dim>
void Simulation<Dim>::start_speed_reduction() {
  if (fault_urgency_ == 0 && !migration_->failure().empty()) fault_urgency_ = 1, fault_ = migration_->failure();
  const Notice notice = ask_ ? ask_() : Notice{};
  const double mine[speed_size] = {speeds_.wave, speeds_.point, static_cast<double>(fault_urgency_),
                                   notice.stop,  notice.wall,   migration_->entered().empty() ? 0.0 : 1.0};
  maxima_.start(mine, comm_);
  speeds_ = {};
}

template <int Dim>
StepState Simulation<Dim>::step_state() {
  finish_speed_reduction();
  return {time_, dt_, maxima_[0], maxima_[1], steps_};
}

template <int Dim>
void Simulation<Dim>::finish_speed_reduction() {
  if (!maxima_.under_way()) return;
  maxima_.finish();
  if (maxima_[2] > 0)
    throw RunError(
        fmt::format("step {}: {}", steps_, common_error(comm_, fault_urgency_ == maxima_[2] ? fault_ : std::string())));
  if (maxima_[5] > 0) add_new_patches();
}

/// Points are in patches that had none before: their neighbours have to exist before nodes are exchanged.
template <int Dim>
void Simulation<Dim>::add_new_patches() {
  const auto time = timers_.measure(Stage::migrate);
  maxima_[5] = 0;
  for (const PatchId id : table_.fill(gather_on_all(migration_->entered(), comm_)))
    if (table_.owner(id) == rank_) patches_.emplace_back(id, lattice_);
  std::ranges::sort(patches_, {}, &Patch<Dim>::id);
  connect_patches();
}

template <int Dim>
void Simulation<Dim>::connect_patches() {
  std::set<int> neighbours;
  for (const auto& patch : patches_)
    for (const auto& link : patch.links)
      if (table_.find(link.patch) >= 0) neighbours.insert(table_.owner(link.patch));
  neighbours.erase(rank_);
  sweeps_.assign(patches_.size(), {}), segments_.assign(patches_.size(), {});
  face_motions_.assign(patches_.size(), {});
  const Traffic traffic = messages_ ? messages_->traffic() : Traffic{};
  messages_ = std::make_unique<NeighbourExchange>(comm_, std::vector<int>(neighbours.begin(), neighbours.end()));
  messages_->traffic() = traffic;
  exchange_ = std::make_unique<NodeExchange<Dim>>(*messages_, table_, patches_);
  beside_others_.clear();
  for (std::size_t p = 0; p < patches_.size(); ++p) beside_others_.push_back(exchange_->beside_others(p));
  Exits<Dim> exits;
  for (int face = 0; face < 2 * Dim; ++face)
    exits.open[face] = contact_.faces[face].type == FaceType::free && contact_.faces[face].leaving == Leaving::remove;
  exits.drop_lost = solver_.lost_points == LostPoints::drop;
  exits.book = [this](auto&&... departing) { book_departures(departing...); };
  migration_ = std::make_unique<Migration<Dim>>(*messages_, table_, std::move(exits));
}

/// Bodies that move on leave empty patches behind. Where these have become many, those without a history go.
template <int Dim>
void Simulation<Dim>::forget_blank_patches() {
  enum : std::uint8_t { blank, kept, filled };
  std::vector<std::uint8_t> uses(table_.size(), blank);
  for (const auto& patch : patches_)
    uses[table_.find(patch.id)] = patch.point_count() > 0 ? filled : patch.blank() ? blank : kept;
  MPI_Allreduce(MPI_IN_PLACE, uses.data(), static_cast<int>(uses.size()), MPI_UINT8_T, MPI_MAX, comm_);
  constexpr std::size_t few = 64;
  if (static_cast<std::size_t>(std::ranges::count(uses, blank)) < 2 * blank_before_ + few) return;
  std::vector<PatchId> with_points, others;
  for (std::size_t p = 0; p < uses.size(); ++p)
    if (uses[p] != blank) (uses[p] == filled ? with_points : others).push_back(table_.patches()[p]);
  table_.restrict_to(with_points, others);
  blank_before_ = table_.size() - with_points.size() - others.size();
  std::erase_if(patches_, [&](const Patch<Dim>& patch) { return table_.find(patch.id) < 0; });
  connect_patches();
}

/// Looks at the work of all ranks since the last time, and deals the patches out anew where that evens it out.
template <int Dim>
void Simulation<Dim>::balance() {
  const auto time = timers_.measure(Stage::migrate);
  finish_speed_reduction();
  forget_blank_patches();
  if (ranks_ == 1 || parallel_.partition != Partition::metis) return;
  std::vector<std::int64_t> work(table_.size(), 0);
  for (auto& patch : patches_)
    work[table_.find(patch.id)] = static_cast<std::int64_t>(patch.seconds * 1e9), patch.seconds = 0;
  MPI_Allreduce(MPI_IN_PLACE, work.data(), static_cast<int>(work.size()), MPI_INT64_T, MPI_SUM, comm_);
  const std::vector<int> before = table_.owners();
  const double now = imbalance_of(work, before, ranks_);
  if (now < parallel_.imbalance) return;
  const double start = MPI_Wtime();
  const auto parts = distribute_patches(lattice_, table_.patches(), work, ranks_, Partition::metis);
  const auto owner = keep_in_place(parts, before, work, ranks_);
  if (imbalance_of(work, owner, ranks_) > 0.95 * now) return;
  move_patches(patches_, table_, owner, lattice_, comm_);
  connect_patches();
  ++times_balanced_;
  seconds_balancing_ += MPI_Wtime() - start;
}

template class Simulation<2>;
template class Simulation<3>;

}  // namespace cairn
