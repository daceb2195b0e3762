#include "history_tables.hpp"

#include <algorithm>

#include "cairn/solver/body_states.hpp"

namespace cairn {

std::vector<std::string> history_columns(int dimension) {
  std::vector<std::string> names = {"step",
                                    "time",
                                    "dt",
                                    "kinetic_energy",
                                    "strain_energy",
                                    "potential_energy",
                                    "plastic_dissipation",
                                    "contact_dissipation",
                                    "boundary_work",
                                    "energy_error",
                                    "momentum_x",
                                    "momentum_y"};
  if (dimension == 3) names.emplace_back("momentum_z");
  names.insert(names.end(), {"contact_nodes", "mass", "viscous_dissipation", "numerical_dissipation",
                             "filter_dissipation", "contact_gain", "points_stopped", "points_left", "points_lost",
                             "mass_left", "energy_left", "momentum_left_x", "momentum_left_y"});
  if (dimension == 3) names.emplace_back("momentum_left_z");
  names.insert(names.end(), {"crack_energy", "crack_dissipation", "damping_dissipation", "unbalanced_force",
                             "largest_unbalanced_force", "length_x", "length_y"});
  if (dimension == 3) names.emplace_back("length_z");
  names.insert(names.end(), {"stress_xx", "stress_yy", "stress_zz", "stress_xy"});
  if (dimension == 3) names.insert(names.end(), {"stress_yz", "stress_xz"});
  names.insert(names.end(), {"shear_rate", "inertial_number"});
  return names;
}

std::vector<std::string> body_columns(int dimension) {
  if (dimension == 2) return {"step", "time", "body", "x", "y", "vx", "vy", "wx", "wy", "wz", "lx", "ly", "lz"};
  return {"step", "time", "body", "x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz", "lx", "ly", "lz"};
}

std::vector<std::string> force_columns() {
  return {"step", "time", "tool", "name", "x",  "y",  "z",  "vx",        "vy",        "vz",        "wx",  "wy",
          "wz",   "fx",   "fy",   "fz",   "mx", "my", "mz", "impulse_x", "impulse_y", "impulse_z", "work"};
}

std::vector<std::string> tip_columns(int dimension) {
  if (dimension == 3)
    return {"step",    "time",    "crack", "index", "x",        "y",   "z",    "ahead_x",
            "ahead_y", "ahead_z", "grown", "J",     "J_static", "K_I", "K_II", "K_III"};
  return {"step", "time", "crack", "end", "x", "y", "ahead_x", "ahead_y", "grown", "J", "J_static", "K_I", "K_II"};
}

template <int Dim>
void HistoryTables<Dim>::open(const RunState* from) {
  const auto history = out_ / "history.csv", bodies = out_ / "bodies.csv", forces = out_ / "forces.csv";
  const bool go_on = from != nullptr && std::filesystem::exists(history);
  history_ =
      go_on ? CsvWriter(history, history_columns(Dim), from->history_file) : CsvWriter(history, history_columns(Dim));
  if (go_on && from->bodies_file.bytes > 0)
    bodies_ = CsvWriter(bodies, body_columns(Dim), from->bodies_file);
  else if (!track_.empty())
    bodies_ = CsvWriter(bodies, body_columns(Dim));
  if (go_on && from->forces_file.bytes > 0)
    forces_ = CsvWriter(forces, force_columns(), from->forces_file);
  else if (with_forces_)
    forces_ = CsvWriter(forces, force_columns());
  if (go_on && from->tips_file.bytes > 0)
    tips_ = CsvWriter(out_ / "tips.csv", tip_columns(Dim), from->tips_file);
  else if (with_tips_)
    tips_ = CsvWriter(out_ / "tips.csv", tip_columns(Dim));
}

template <int Dim>
void HistoryTables<Dim>::note_positions(RunState& state) const {
  state.history_file = history_.position();
  if (bodies_.position().bytes > 0) state.bodies_file = bodies_.position();
  if (forces_.position().bytes > 0) state.forces_file = forces_.position();
  if (tips_.position().bytes > 0) state.tips_file = tips_.position();
}

template <int Dim>
void HistoryTables<Dim>::add(const Simulation<Dim>& simulation, const Totals& t, double energy_error) {
  std::vector<CsvValue> row = {simulation.steps(), simulation.time(), simulation.dt(), t.kinetic,
                               t.strain,           t.potential,       t.plastic,       t.contact_dissipation,
                               t.boundary_work,    energy_error};
  for (int d = 0; d < Dim; ++d) row.emplace_back(t.momentum[d]);
  row.emplace_back(static_cast<std::int64_t>(t.contact_nodes));
  row.emplace_back(t.mass);
  row.emplace_back(t.viscous);
  row.emplace_back(t.numerical);
  row.emplace_back(t.filtered);
  row.emplace_back(t.contact_gain);
  row.emplace_back(static_cast<std::int64_t>(t.stopped));
  row.emplace_back(static_cast<std::int64_t>(t.points_left));
  row.emplace_back(static_cast<std::int64_t>(t.points_lost));
  for (const double left : {t.mass_left, t.energy_left, t.momentum_left_x, t.momentum_left_y}) row.emplace_back(left);
  if (Dim == 3) row.emplace_back(t.momentum_left_z);
  row.insert(row.end(), {t.crack_energy, t.crack_dissipation, t.damped, simulation.force_balance().mean(),
                         simulation.force_balance().largest()});
  for (int d = 0; d < Dim; ++d) row.emplace_back(simulation.face_distance(2 * d));
  row.insert(row.end(), t.stress.begin(), t.stress.begin() + symmetric_size<Dim>);
  row.insert(row.end(),
             {shear_rate(t.velocity_gradient, Dim), inertial_number(t, simulation.force_balance().bodies, Dim)});
  history_.add_row(row);  // nothing where the file is not open: on other ranks
  if (!track_.empty()) add_bodies(simulation);
}

template <int Dim>
void HistoryTables<Dim>::add_bodies(const Simulation<Dim>& simulation) {
  // Tracked bodies are few: each rank sends those it answers for to rank 0.
  constexpr int width = 13;
  std::vector<double> mine;
  for (const BodyState& s : body_states(simulation))
    if (std::find(track_.begin(), track_.end(), s.body) != track_.end()) {
      mine.push_back(s.body);
      for (const Vec3& v : {s.centre, s.velocity, s.angular_velocity, s.angular_momentum})
        mine.insert(mine.end(), v.data(), v.data() + 3);
    }
  const std::vector<double> all = gather_on_first(mine, simulation.communicator());
  for (std::size_t i = 0; i < all.size(); i += width) {
    std::vector<CsvValue> row = {simulation.steps(), simulation.time(), static_cast<std::int64_t>(all[i])};
    for (int group = 0; group < 4; ++group)
      for (int d = 0; d < 3; ++d)
        if (d < Dim || group >= 2) row.emplace_back(all[i + 1 + 3 * group + d]);
    bodies_.add_row(row);
  }
}

template <int Dim>
void HistoryTables<Dim>::add_forces(const Simulation<Dim>& simulation) {
  const std::vector<ToolSum> sums = simulation.tool_sums();
  const double dt = simulation.dt();
  for (std::size_t t = 0; t < simulation.tools().size(); ++t) {
    const Tool& tool = simulation.tools()[t];
    if (!simulation.has_tool(static_cast<int>(t))) continue;
    const ToolSum& sum = sums[t];
    const Vec3 x = tool.centre + tool.travel, impulse(sum.last[0], sum.last[1], sum.last[2]);
    const Vec3 moment = Vec3(sum.last[3], sum.last[4], sum.last[5]) - x.cross(impulse);
    std::vector<CsvValue> row = {simulation.steps(), simulation.time(), static_cast<std::int64_t>(t), tool.name};
    for (const Vec3& v : {x, tool.now, tool.spin_now}) row.insert(row.end(), v.data(), v.data() + 3);
    for (const Vec3& v : {impulse, moment})
      for (int i = 0; i < 3; ++i) row.emplace_back(dt > 0 ? v[i] / dt : 0.0);
    for (int i : {0, 1, 2, 6}) row.emplace_back(sum.total[i]);
    forces_.add_row(row);
  }
}

template <int Dim>
void HistoryTables<Dim>::add_tips(Simulation<Dim>& simulation) {
  for (const TipState<Dim>& s : simulation.tip_states()) {
    std::vector<CsvValue> row = {simulation.steps(), simulation.time(), std::int64_t{s.tip.crack},
                                 std::int64_t{s.tip.end}};
    for (const Vec<Dim>& v : {s.tip.position, s.tip.ahead}) row.insert(row.end(), v.data(), v.data() + Dim);
    for (const double value : {s.length, s.J, s.J_static, s.K_opening, s.K_sliding}) row.emplace_back(value);
    if (Dim == 3) row.emplace_back(s.K_tearing);
    tips_.add_row(row);
  }
}

template class HistoryTables<2>;
template class HistoryTables<3>;

}  // namespace cairn
