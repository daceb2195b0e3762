#include "stage_keeper.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

/// A motion given anew begins now; one that is as before goes on.
void replace(MotionTable& motion, const MotionTable& by, double since) {
  if (motion.same_as(by)) return;
  motion = by;
  motion.start = since;
}

void replace(Piston& piston, const Piston& by, double since) {
  MotionTable force = piston.force;
  replace(force, by.force, since);
  piston = by;
  piston.force = force;
}

/// A target of another kind begins now in any case.
void replace(AxisDeformation& axis, const AxisDeformation& by, double since) {
  MotionTable target = axis.by == by.by ? axis.target : MotionTable();
  replace(target, by.target, since);
  axis = by;
  axis.target = target;
}

int tool_of(const std::vector<Tool>& tools, const std::string& name) {
  return static_cast<int>(std::ranges::find(tools, name, &Tool::name) - tools.begin());
}

/// The way a tool presses: a face into the domain, a piston along its direction.
Vec3 pressing_way(const Tool& tool, int number) {
  if (number >= tools_of_faces) return tool.piston.along;
  Vec3 way = Vec3::Zero();
  way[number / 2] = number % 2 ? -1 : 1;
  return way;
}

constexpr double looks_at_rest = 3;  // in a row

}  // namespace

void apply_stage(Case& c, const RunStage& stage, double since) {
  const Case& by = *stage.changed;
  replace(c.domain.gravity, by.domain.gravity, since);
  for (std::size_t k = 0; k < c.domain.deformation.axes.size(); ++k)
    replace(c.domain.deformation.axes[k], by.domain.deformation.axes[k], since);
  for (std::size_t f = 0; f < c.faces.size(); ++f) {
    replace(c.faces[f].velocity, by.faces[f].velocity, since);
    replace(c.faces[f].piston, by.faces[f].piston, since);
    c.faces[f].friction = by.faces[f].friction;
  }
  for (std::size_t d = 0; d < c.drives.size(); ++d) {
    replace(c.drives[d].velocity, by.drives[d].velocity, since);
    replace(c.drives[d].angular_velocity, by.drives[d].angular_velocity, since);
    replace(c.drives[d].piston, by.drives[d].piston, since);
    replace(c.drives[d].rotor, by.drives[d].rotor, since);
  }
  c.contact = by.contact, c.damping = by.damping, c.output = by.output;
  c.time.cfl = by.time.cfl, c.time.dt = by.time.dt;
}

StageKeeper::StageKeeper(const Case& c, const RunState* from) : case_(c) {
  if (!from) return;
  noted_ = true;
  const std::vector<double>& state = from->stage;
  constexpr int least = 1 + 2 * look_size;  // numbers: the stage, and what was seen last
  const std::ptrdiff_t stages = std::max<std::ptrdiff_t>(1, std::ssize(c.stages)), stage = std::ssize(state) - least;
  if (stage < 0 || stage >= stages || state[0] != static_cast<double>(stage))
    throw InputError(
        "the checkpoint is of another stage than the case has; restore [[stage]], or run without --restart");
  stage_ = static_cast<int>(stage);
  const double* at = &state[1];
  for (Look* look : {&of_run_, &of_stage_}) {
    look->since = at[0], look->time = at[1], look->rests = at[2];
    for (int i = 0; i < 3; ++i) look->impulse[i] = at[3 + i], look->place[i] = at[6 + i];
    look->length = at[9];
    at += look_size;
  }
  begun_.assign(at, state.data() + state.size());
  const double now = from->step.time;
  if (!of_run_.may_be_at(now) || !of_stage_.may_be_at(now) || !std::ranges::is_sorted(begun_) ||
      (!begun_.empty() && !(begun_.front() >= 0 && begun_.back() <= now)))
    throw InputError("the checkpoint's stages did not begin before now, one after the other");
}

std::vector<double> StageKeeper::state() const {
  std::vector<double> state = {static_cast<double>(stage_)};
  for (const Look* look : {&of_run_, &of_stage_}) {
    state.insert(state.end(), {look->since, look->time, look->rests});
    state.insert(state.end(), look->impulse.begin(), look->impulse.end());
    state.insert(state.end(), look->place.begin(), look->place.end());
    state.push_back(look->length);
  }
  state.insert(state.end(), begun_.begin(), begun_.end());
  return state;
}

void StageKeeper::bring_up(Case& c) const {
  for (int s = 0; s <= stage_ && s < std::ssize(c.stages); ++s)
    apply_stage(c, c.stages[s], s == 0 ? 0.0 : begun_[s - 1]);
}

double StageKeeper::end() const {
  double end = std::min({case_.time.end, case_.time.until.time, case_.time.until.duration});
  if (const Until* until = of_stage()) end = std::min({end, until->time, of_stage_.since + until->duration});
  return end;
}

bool StageKeeper::weighs(std::int64_t next_step) const {
  const auto asks = [&](const Until& u) { return u.rest > 0 && next_step % u.every == 0; };
  return asks(case_.time.until) || (of_stage() && asks(*of_stage()));
}

void StageKeeper::begin_next(double time) {
  ++stage_;
  begun_.push_back(time);
  of_stage_ = {};
  of_stage_.since = of_stage_.time = time;
  noted_ = false;
}

template <int Dim>
void StageKeeper::note_start(const Simulation<Dim>& simulation) {
  if (std::exchange(noted_, true)) return;
  const auto note = [&](const Until& until, Look& look) {
    const int tool = tool_of(simulation.tools(), until.of);
    if (until.of == whole_domain)
      for (int d = 0; d < Dim; ++d) look.place[d] = simulation.lattice().length(d);
    if (until.of.empty() || tool == std::ssize(simulation.tools())) return;
    const Vec3 place = simulation.tools()[tool].place();
    std::copy_n(place.data(), 3, look.place.begin());
    if (tool < tools_of_faces) look.length = simulation.face_distance(tool);
    const std::vector<double> impulse = simulation.impulse_on(tool);
    std::copy_n(impulse.begin(), 3, look.impulse.begin());
  };
  if (simulation.steps() == 0) note(case_.time.until, of_run_);
  if (of_stage()) note(*of_stage(), of_stage_);
}

/// Whether the mean force since the last look is as large, or small, as it says.
template <int Dim>
std::string StageKeeper::force_met(const Until& until, Look& look, const Simulation<Dim>& simulation, int tool) {
  const Tool& t = simulation.tools()[tool];
  const std::vector<double> impulse = simulation.impulse_on(tool);
  Vec3 mean = Vec3::Zero();
  for (int i = 0; i < 3; ++i) mean[i] = (impulse[i] - look.impulse[i]) / (simulation.time() - look.time);
  std::copy_n(impulse.begin(), 3, look.impulse.begin());
  const Vec3 way = pressing_way(t, tool);
  const double force = way == Vec3::Zero() ? mean.norm() : -mean.dot(way);
  const auto reached = [&](double value, double limit) {
    return std::isfinite(limit) && (until.falls ? value <= limit : value >= limit);
  };
  if (reached(force, until.force)) return fmt::format("the force on {} is {:.6g} N", t.name, force);
  if (!std::isfinite(until.pressure)) return {};
  const double area = until.area > 0 ? until.area : simulation.face_area(tool);
  return reached(force / area, until.pressure) ? fmt::format("the pressure on {} is {:.6g} Pa", t.name, force / area)
                                               : "";
}

template <int Dim>
std::string StageKeeper::domain_met(const Until& until, const Look& look, const Simulation<Dim>& simulation) {
  double strain = 0;
  for (int d = 0; d < Dim; ++d) strain = std::max(strain, std::abs(simulation.lattice().length(d) / look.place[d] - 1));
  if (strain >= until.strain) return fmt::format("the strain of the domain is {:.6g}", strain);
  if (!std::isfinite(until.pressure)) return {};
  const auto stress = simulation.mean_stress();
  double pressure = 0;
  for (int d = 0; d < Dim; ++d) pressure -= stress[d] / Dim;
  const bool reached = until.falls ? pressure <= until.pressure : pressure >= until.pressure;
  return reached ? fmt::format("the pressure in the domain is {:.6g} Pa", pressure) : "";
}

template <int Dim>
std::string StageKeeper::met(const Until& until, Look& look, const Simulation<Dim>& simulation) {
  const double time = simulation.time();
  if (time >= until.time * (1 - 1e-12)) return fmt::format("time {} s", until.time);
  if (time - look.since >= until.duration * (1 - 1e-12)) return fmt::format("{} s have passed", until.duration);
  if (simulation.steps() % until.every != 0) return {};
  std::string why;
  const int tool = tool_of(simulation.tools(), until.of);
  const bool domain = until.of == whole_domain;
  if (domain)
    why = domain_met(until, look, simulation);
  else if (std::isfinite(until.force) || std::isfinite(until.pressure))
    why = force_met(until, look, simulation, tool);
  if (why.empty() && !domain && std::isfinite(until.strain)) {
    const Vec3 way = simulation.tools()[tool].place() - Vec3(look.place.data());
    const Vec3 along = pressing_way(simulation.tools()[tool], tool);
    const double strain = (along == Vec3::Zero() ? way.norm() : std::abs(way.dot(along))) /
                          (until.length > 0 ? until.length : look.length);
    if (strain >= until.strain) why = fmt::format("the strain by {} is {:.6g}", until.of, strain);
  }
  if (why.empty() && std::isfinite(until.packing)) {
    const double packing = simulation.packing_fraction();
    if (until.falls ? packing <= until.packing : packing >= until.packing)
      why = fmt::format("the packing fraction is {:.6g}", packing);
  }
  if (why.empty() && until.rest > 0) {
    const ForceBalance balance = simulation.force_balance();
    look.rests = balance.pressing > 0 && balance.mean() < until.rest ? look.rests + 1 : 0;
    if (look.rests >= looks_at_rest) why = fmt::format("at rest, the unbalanced force is {:.3g}", balance.mean());
  }
  look.time = time;
  return why;
}

template <int Dim>
std::string StageKeeper::ended(const Simulation<Dim>& simulation) {
  std::string why = met(case_.time.until, of_run_, simulation);
  run_ended_ = !why.empty();
  if (run_ended_ || !of_stage()) return why;
  why = met(*of_stage(), of_stage_, simulation);
  run_ended_ = !why.empty() && stage_ + 1 == static_cast<int>(case_.stages.size());
  return why;
}

template std::string StageKeeper::ended(const Simulation<2>&);
template std::string StageKeeper::ended(const Simulation<3>&);
template void StageKeeper::note_start(const Simulation<2>&);
template void StageKeeper::note_start(const Simulation<3>&);

}  // namespace cairn
