#include "cairn/solver/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "cairn/core/error.hpp"
#include "cairn/io/agreement.hpp"

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
  grow_cracks();
  split_bodies();
  choose_time_step(longest);
  begin_tools();
  filter_noise();
  for (auto& round : schedule_) carry_out(round);
  if (keep_balance_) balance_ = weigh_bodies();
  receive_points();
  end_tools();
  time_ += dt_;
  ++steps_;
  deform();
  relax();
  remove_bodies();
  insert_bodies();
  if (gravity_.varies()) pull_by(gravity_.at(time_));
  if (parallel_.balance_every > 0 && steps_ % parallel_.balance_every == 0) balance();
}

template <int Dim>
void Simulation<Dim>::carry_out(StepRound<Dim>& round) {
  const Traffic before = traffic();
  const auto compute = [&](std::size_t p, Patch<Dim>& patch) {
    for (const auto& stage : round.stages) (this->*stage.compute)(p, patch);
  };
  switch (round.sent) {
    case Sent::sums:
      exchange_->begin_sums(transfer_.extras);
      exchange_after(compute);
      break;
    case Sent::forces:
      exchange_->begin(&NodeBox<Dim>::force);
      exchange_after(compute);
      exchange_tractions();
      look_for_fault(round, 2);
      break;
    case Sent::momenta:
      exchange_->begin(&NodeBox<Dim>::velocity);
      exchange_after(compute);
      push_tools();
      break;
    case Sent::points:
      aim_walls();
      migrate_after(compute);
      look_for_fault(round, 1);
      break;
  }
  round.traffic.messages += traffic().messages - before.messages;
  round.traffic.bytes += traffic().bytes - before.bytes;
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
  if (limits_.dt > traction_dt_)
    throw RunError(
        fmt::format("step {}: time.dt = {:.6g} s is too long for the stiffness between the faces of a crack; "
                    "give at most {:.6g} s, or leave it to time.cfl",
                    steps_ + 1, limits_.dt, traction_dt_));
  if (speed > 0 || dt_ == 0) dt_ = limits_.dt > 0 ? limits_.dt : limits_.cfl * cell / speed;  // else no point is left
  if (!(dt_ > 0) || !std::isfinite(dt_))
    throw RunError(fmt::format("step {}: the time step collapsed (wave speed {} m/s, point speed {} m/s)", steps_ + 1,
                               maxima_[0], maxima_[1]));
  dt_ = std::min(dt_, traction_dt_);
  // Reach the end exactly, without a last step of a rounding error's length.
  if (dt_ * (1 + 1e-9) >= longest) dt_ = longest;
}

template <int Dim>
void Simulation<Dim>::project_points(std::size_t /*p*/, Patch<Dim>& patch) {
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

/// Projects a piece for the step that comes next, unless places then are not known yet: of cracks, or in a domain that
/// deforms.
template <int Dim>
void Simulation<Dim>::project_ahead(Patch<Dim>& patch, Piece<Dim>& piece) {
  if (!patch.cracks.empty() || deformation_.active()) return;
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
void Simulation<Dim>::strain_first(std::size_t p, Patch<Dim>& patch) {
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
        update_stress_and_force(piece, lattice_, transfer_, material.law, material.density, part * strain_share() * dt_,
                                speeds);
      });
    if (!projects_again()) velocities_.take_back(piece.nodes.velocity);
  });
  find_tractions(p);
}

template <int Dim>
void Simulation<Dim>::complete_forces(std::size_t p, Patch<Dim>& patch) {
  const auto time = timers_.measure(Stage::exchange);
  fetch_nodes(patch);
  exchange_->add(patch, p);
  if (!row_forces_[p].empty()) add_row_forces(patch, surroundings_of(patch), row_forces_[p]);
  mirror_vectors(patch, lattice_, contact_.faces, &NodeBox<Dim>::force);
}

template <int Dim>
void Simulation<Dim>::contact_after_update(std::size_t p, Patch<Dim>& patch) {
  const bool last = !projects_again();
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
  weigh_forces(patch);
}

template <int Dim>
void Simulation<Dim>::accelerate_points(std::size_t /*p*/, Patch<Dim>& patch) {
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
  for (auto& piece : patch.pieces) solver_.motion == Motion::projected ? follow_projected(piece) : centre_motion(piece);
}

/// The last pass over the points: what is left to do with them, and they move. Those that left the patch are taken out;
/// a piece that kept all of its points is projected for the next step at once, while they are in the cache.
template <int Dim>
void Simulation<Dim>::finish_points(std::size_t p, Patch<Dim>& patch) {
  using C = PointColumns<Dim>;
  const bool strained = solver_.stress_update == StressUpdate::first;
  if (!patch.cracks.empty()) face_motions_[p] = find_face_velocities(patch.cracks, surroundings_of(patch));
  const auto time = timers_.measure(strained ? Stage::update : Stage::stress);
  for_pieces(patch, {{C::position, strained ? C::state : all_columns}}, [&](Piece<Dim>& piece) {
    damp(patch, piece);
    finish_piece(patch, piece);
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
void Simulation<Dim>::finish_piece(Patch<Dim>& patch, Piece<Dim>& piece) {
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
    update_stress_and_move(piece, lattice_, transfer_, material.law, material.density, part * strain_share() * dt_,
                           part * dt_, speeds);
  });
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
      for (auto& piece : patch.pieces) {
        sort_by_cell(piece, lattice_, patch.cells);
        freeze_domains(piece, lattice_, transfer_);
      }
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
  StepState state{time_, dt_, maxima_[0], maxima_[1], steps_, kinetic_, Vec3::Zero(), needed_rates_};
  state.upper.template head<Dim>() = lattice_.upper();
  return state;
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

template class Simulation<2>;
template class Simulation<3>;

}  // namespace cairn
