// Good checkpoints, and states that are changed in memory.

#include <fmt/format.h>

#include <fstream>
#include <limits>
#include <sstream>

#include "../support/cases.hpp"
#include "cairn/io/case_changes.hpp"
#include "cairn/io/checksum.hpp"
#include "forger.hpp"

namespace cairn::fuzz {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
constexpr std::int64_t largest = std::numeric_limits<std::int64_t>::max();
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

struct Target {
  int patch, piece;
};

/// The pieces that hold points.
template <int Dim>
std::vector<Target> filled(const std::vector<Patch<Dim>>& patches) {
  std::vector<Target> all;
  for (int p = 0; p < std::ssize(patches); ++p)
    for (int k = 0; k < std::ssize(patches[p].pieces); ++k)
      if (patches[p].pieces[k].points.size() > 0) all.push_back({p, k});
  return all;
}

/// Changes something about one point.
template <int Dim>
std::string change_point(Simulation<Dim>& simulation, Random& random, Expectation& expected) {
  using C = PointColumns<Dim>;
  auto& patches = simulation.patches();
  const Target target = random.any(filled(patches));
  Points<Dim>& points = patches[target.patch].pieces[target.piece].points;
  const int p = static_cast<int>(random.below(points.size())), c = static_cast<int>(random.below(points.columns()));
  const auto set = [&](const char* what, int column, double value) {
    points.column(column)[p] = value;
    return fmt::format("point {}: {} = {}", points.ids()[p], what, value);
  };
  expected = Expectation::refused;
  switch (random.below(8)) {
    case 0:
      return set("column", c, random.any(std::vector<double>{nan, infinity, -infinity}));
    case 1:
      return set("position", static_cast<int>(random.below(Dim)), random.any(std::vector<double>{-1, 2, 1e300, -1e18}));
    case 2:
      return set("volume", C::volume, random.any(std::vector<double>{0, -1e-4}));
    case 3:
      return set("F", C::deformation, random.any(std::vector<double>{-1, -1e3}));
    case 4:
      points.ids()[p] = -5;
      return "a negative id";
    case 5:
      if (points.size() == 1) return set("volume", C::volume, 0);
      points.ids()[p] = points.ids()[p == 0 ? 1 : p - 1];
      return "an id twice";
    case 6:
      points.images()[p][1] = 3;  // not periodic
      return "an image";
    default:
      expected = Expectation::any;
      return set("velocity", C::velocity, random.any(std::vector<double>{0, -3, 1e6, 1e150, 1e300}));
  }
}

/// Changes something about pieces or contacts.
template <int Dim>
std::string change_table(Simulation<Dim>& simulation, Random& random, Expectation& expected) {
  auto& patches = simulation.patches();
  const auto pieces = filled(patches);
  const Target target = random.any(pieces);
  Patch<Dim>& patch = patches[target.patch];
  expected = Expectation::refused;
  const std::size_t kind = random.below(5);
  if (kind == 0) {
    patch.pieces[target.piece].body = random.any(std::vector<int>{-1, 3, 1 << 30, std::numeric_limits<int>::min()});
    return fmt::format("a body {}", patch.pieces[target.piece].body);
  }
  if (kind == 1) {
    for (const Target& other : pieces)  // two pieces of a patch in the wrong order
      if (other.piece > 0 && patches[other.patch].pieces[other.piece - 1].points.size() > 0) {
        auto& list = patches[other.patch].pieces;
        std::swap(list[other.piece], list[other.piece - 1]);
        return "pieces in the wrong order";
      }
  }
  ContactSum<Dim> sum;
  sum.values[0] = 1;
  if (kind == 2) {
    const auto value = random.any(std::vector<double>{nan, infinity, -infinity});
    sum.values[random.below(sum.values.size())] = value;
    patch.contacts[{0, 1}] = sum;
    return fmt::format("a contact sum {}", value);
  }
  if (kind == 3) {
    sum.values[0] = -1;
    patch.contacts[{0, 1}] = sum;
    return "a negative weight";
  }
  const auto pair =
      random.any(std::vector<std::pair<int, int>>{{1, 0}, {1, 1}, {-1, 1}, {0, 9}, {-7, -5}, {0, 1 << 30}});
  patch.contacts[pair] = sum;
  return fmt::format("a contact of {} and {}", pair.first, pair.second);
}

/// Changes a number of the run's state beyond what it can be.
std::string change_number(RunState& state, Random& random) {
  std::size_t count = 0;
  for_each_number(state, [&](const std::string&, auto&) { ++count; });
  const std::size_t wanted = random.below(count);
  const double bad = random.any(std::vector<double>{nan, infinity, -infinity});
  const std::int64_t wrong = random.any(std::vector<std::int64_t>{-2, std::numeric_limits<std::int64_t>::min()});
  std::size_t at = 0;
  std::string what;
  for_each_number(state, [&]<class T>(const std::string& name, T& value) {
    if (at++ != wanted) return;
    if constexpr (std::is_same_v<T, double>)
      value = bad;
    else if constexpr (std::is_same_v<T, std::int64_t>)
      value = wrong;
    what = fmt::format("{} = {}", name, value);
    if constexpr (std::is_same_v<T, std::uint64_t>) state.step.time = bad, what = "time";
  });
  return what;
}

std::string change_series(RunState& state, Random& random) {
  auto& series = state.series;
  const std::size_t at = random.below(series.size());
  switch (random.below(6)) {
    case 0:
      series[at].name =
          random.any(std::vector<std::string>{"../../etc/passwd", "", "particles_999999.vtkhdf", "\x1b[2J",
                                              "particles_000000.vtkhdf\n", "checkpoint_000000.h5"});
      break;
    case 1:
      series[at].time = random.any(std::vector<double>{nan, -1, 1e300, infinity});
      break;
    case 2:
      series.push_back(series[at]);
      break;
    case 3:
      std::swap(series.front(), series.back());
      break;
    case 4:
      state.particles.count = 0;
      break;
    default:
      state.contacts.count = largest;
  }
  return "the list of files or its count";
}

std::string change_text(std::string& text, Random& random, Expectation& expected) {
  expected = Expectation::any;
  switch (random.below(4)) {
    case 0:
      text = std::string(100'000, '[');
      break;
    case 1:
      text = "a";
      for (int i = 0; i < 50'000; ++i) text += ".a";
      text += " = 1\n";
      break;
    case 2:
      text[random.below(text.size())] = static_cast<char>(random.below(256));
      break;
    default:
      text += "\xff\xfe = \"\x1b[31m\"";
  }
  return "the text of the case";
}

}  // namespace

template <int Dim>
std::uint64_t digest_of(const Simulation<Dim>& simulation, const RunState& state, const std::string& case_text) {
  Checksum sum;
  const auto add = [&](const std::string& name, const auto& value) {
    sum.add_values(std::span(name.data(), name.size()));
    sum.add_values(std::span(&value, 1));
  };
  add("time", state.step.time), add("step", state.step.steps);
  for_each_number(state, add);
  for (const auto& entry : state.series) add(entry.name, entry.time);
  sum.add_values(std::span(case_text.data(), case_text.size()));
  for (const auto& patch : simulation.patches()) {
    if (patch.blank()) continue;  // of those, others may be there after a restart
    const PatchLedger& ledger = patch.ledger;
    add("ledger", std::array{ledger.contact_dissipation, ledger.boundary_work, ledger.blended_and_spun,
                             static_cast<double>(ledger.contact_nodes)});
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
Seed<Dim> make_seed(const std::filesystem::path& scratch) {
  Seed<Dim> seed;
  seed.spec = make_case<Dim>();
  Simulation<Dim> simulation(seed.spec, MPI_COMM_SELF);
  for (int i = 0; i < 30; ++i) simulation.step(1e300);
  RunState& state = seed.state;
  state.step = simulation.step_state();
  state.bodies = bodies_checksum(seed.spec);
  state.particles = {30, 0.9 * state.step.time, 0, 7};
  state.contacts = state.particles, state.contacts_kept = 1;
  for (int i : {0, 1, 2, 4, 6})
    state.series.push_back({fmt::format("particles_{:06}.vtkhdf", i), 0.1 * i * state.step.time});
  const auto file = scratch / fmt::format("seed_{}.h5", Dim);
  write_checkpoint(file, simulation, state, seed.spec.resolved);
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  seed.bytes = bytes.str();
  seed.bytes.resize(seed.bytes.size() - seal_bytes);
  const Checkpoint again(file, MPI_COMM_SELF);
  seed.digest = digest_of(Simulation<Dim>(seed.spec, MPI_COMM_SELF, &again), again.state(), again.case_text());
  if (seed.digest != digest_of(simulation, state, seed.spec.resolved))
    throw std::logic_error("a checkpoint is not what was written");
  return seed;
}

template <int Dim>
std::string change_state(const Seed<Dim>& seed, const std::filesystem::path& file, Random& random,
                         Expectation& expected) {
  const Checkpoint good(file.parent_path() / fmt::format("seed_{}.h5", Dim), MPI_COMM_SELF);
  Simulation<Dim> simulation(seed.spec, MPI_COMM_SELF, &good);
  RunState state = seed.state;
  std::string text = seed.spec.resolved, what;
  expected = Expectation::refused;
  switch (random.below(6)) {
    case 0:
    case 1:
      what = change_point(simulation, random, expected);
      break;
    case 2:
      what = change_table(simulation, random, expected);
      break;
    case 3:
      what = change_number(state, random);
      break;
    case 4:
      what = change_series(state, random);
      break;
    default:
      what = change_text(text, random, expected);
  }
  write_checkpoint(file, simulation, state, text);
  return what;
}

#define CAIRN_INSTANTIATE(Dim)                                                                   \
  template std::uint64_t digest_of(const Simulation<Dim>&, const RunState&, const std::string&); \
  template Seed<Dim> make_seed(const std::filesystem::path&);                                    \
  template std::string change_state(const Seed<Dim>&, const std::filesystem::path&, Random&, Expectation&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn::fuzz
