// Good checkpoints.

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "../support/cases.hpp"
#include "cairn/io/case_changes.hpp"
#include "cairn/io/checksum.hpp"
#include "forger.hpp"

namespace cairn::fuzz {
namespace {

constexpr std::size_t seal_bytes = 40;

template <int Dim>
Case make_case() {
  Case c = test::colliding_balls(Dim, Dim == 2 ? 16 : 8, 4);
  c.domain.periodic = {true, false, false};
  c.materials.push_back(
      {"metal",
       "von_mises",
       1500,
       {{"shear_modulus", 5e3}, {"bulk_modulus", 9e3}, {"yield_stress", 50}, {"hardening_modulus", 10}}});
  c.bodies[1].material = 1;
  c.bodies[0].velocity *= 4, c.bodies[1].velocity *= 4;
  const double z = Dim == 3 ? 0.5 : 0;
  test::add_body(c, Ball{Vec3(0.97, 0.2, z), 0.15}, Vec3(0.3, 0.2, 0));
  c.output.contacts.every = 5, c.output.particles.every = 5;
  c.resolved = "title = \"forged\"\n[domain]\nupper = [1.0, 1.0]\n[[bodies]]\nmaterial = \"soft\"\n";
  return c;
}

}  // namespace

template <int Dim>
Resumed<Dim>::Resumed(const Case& c, const Checkpoint* from)
    : spec(c), stages(spec, from ? &from->state() : nullptr), simulation(brought_up(), MPI_COMM_SELF, from) {
  stages.note_start(simulation);
}

template <int Dim>
const Case& Resumed<Dim>::brought_up() {
  stages.bring_up(spec);
  return spec;
}

template <int Dim>
void Resumed<Dim>::step() {
  simulation.keep_balance(stages.weighs(simulation.steps() + 1));
  simulation.step(stages.end() - simulation.time());
  simulation.notice();
  if (stages.ended(simulation).empty() || stages.run_ended()) return;
  stages.begin_next(simulation.time());
  apply_stage(spec, spec.stages[stages.stage()], simulation.time());
  simulation.change(spec);
  stages.note_start(simulation);
}

template <int Dim>
std::uint64_t digest_of(const Resumed<Dim>& run, const RunState& state, const std::string& case_text) {
  const Simulation<Dim>& simulation = run.simulation;
  Checksum sum;
  const auto add = [&](const std::string& name, const auto& value) {
    sum.add_values(std::span(name.data(), name.size()));
    sum.add_values(std::span(&value, 1));
  };
  add("time", state.step.time), add("step", state.step.steps);
  for_each_number(state, add);
  for (const auto& entry : state.series) add(entry.name, entry.time);
  sum.add_values(std::span(case_text.data(), case_text.size()));
  for (const auto& list : {run.stages.state(), simulation.pouring(), simulation.tool_states(),
                           simulation.crack_states(), simulation.parts(), simulation.spared()})
    add("list", list.size()), sum.add_values(std::span(list));
  for (const auto& patch : simulation.patches()) {
    if (patch.blank()) continue;  // of those, others may be there after a restart
    for (const auto& column : ledger_columns) add(column.name, patch.ledger.*column.value);
    for (const auto& [tool, pressed] : patch.tools) add("tool", tool), add("", pressed.total);
    for (const auto& p : patch.cracks) {
      if (!p.own) continue;
      add("crack",
          std::array{p.crack, p.index, p.next, std::int32_t{p.filled}, p.faces_filled, std::int32_t{p.bond.state}});
      add("bond", std::array{p.bond.length, p.bond.peak[0], p.bond.peak[1], p.bond.dissipated});
      for (const auto& vector : {p.plane, p.lower, p.upper, p.lower_velocity, p.upper_velocity})
        sum.add_values(std::span(vector.data(), static_cast<std::size_t>(Dim)));
      for (const auto image : p.image) add("image", std::int64_t{image});
    }
    for (const auto& [pair, contact] : patch.contacts)
      add("contact", pair.first), add("and", pair.second), add("", contact.values);
    for (const auto& piece : patch.pieces) {
      if (piece.points.size() == 0) continue;
      add("piece", std::array{static_cast<int>(patch.id), piece.body, piece.points.size()});
      const auto size = static_cast<std::size_t>(piece.points.size());
      for (int c = 0; c < piece.points.columns(); ++c) sum.add_values(std::span(piece.points.column(c), size));
      sum.add_values(std::span(piece.points.ids()));
      for (const auto& image : piece.points.images())
        for (int i = 0; i < 3; ++i) add("image", static_cast<std::int64_t>(image[i]));
    }
  }
  return sum.value();
}

template <int Dim>
Seed<Dim> make_seed(const std::filesystem::path& scratch, const std::string& name) {
  Seed<Dim> seed;
  seed.spec = name.empty() ? make_case<Dim>() : read_case(std::filesystem::path(CAIRN_FUZZ_SEEDS) / (name + ".toml"));
  Resumed<Dim> run(seed.spec, nullptr);
  for (int i = 0; i < 30; ++i) run.step();
  RunState& state = seed.state;
  note_simulation(run.simulation, state);
  state.stage = run.stages.state();
  state.bodies = bodies_checksum(seed.spec);
  state.particles = {30, 0.9 * state.step.time, 0, 7};
  state.contacts = state.particles, state.contacts_kept = 1;
  for (int i : {0, 1, 2, 4, 6})
    state.series.push_back({fmt::format("particles_{:06}.vtkhdf", i), 0.1 * i * state.step.time});
  seed.file = scratch / fmt::format("seed_{}_{}.h5", name, Dim);
  write_checkpoint(seed.file, run.simulation, state, seed.spec.resolved);
  std::ostringstream bytes;
  bytes << std::ifstream(seed.file, std::ios::binary).rdbuf();
  seed.bytes = bytes.str();
  seed.bytes.resize(seed.bytes.size() - seal_bytes);
  const Checkpoint again(seed.file, MPI_COMM_SELF);
  seed.digest = digest_of(Resumed<Dim>(seed.spec, &again), again.state(), again.case_text());
  if (seed.digest != digest_of(run, state, seed.spec.resolved))
    throw std::logic_error("a checkpoint is not what was written");
  return seed;
}

#define CAIRN_INSTANTIATE(Dim)                                                                \
  template struct Resumed<Dim>;                                                               \
  template std::uint64_t digest_of(const Resumed<Dim>&, const RunState&, const std::string&); \
  template Seed<Dim> make_seed(const std::filesystem::path&, const std::string&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn::fuzz
