// States of a run, changed in memory and written with all checksums right.

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
  const auto bodies = static_cast<int>(simulation.bodies().size());
  const Target target = random.any(pieces);
  Patch<Dim>& patch = patches[target.patch];
  expected = Expectation::refused;
  const std::size_t kind = random.below(5);
  if (kind == 0) {
    patch.pieces[target.piece].body =
        random.any(std::vector<int>{-1, bodies, 1 << 30, std::numeric_limits<int>::min()});
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
  const auto pair = random.any(
      std::vector<std::pair<int, int>>{{1, 0}, {1, 1}, {-1, 1}, {0, bodies + 2 * Dim}, {-7, -5}, {0, 1 << 30}});
  patch.contacts[pair] = sum;
  return fmt::format("a contact of {} and {}", pair.first, pair.second);
}

/// Changes a crack point. All that the file says of one is told wrong in turn.
template <int Dim>
std::string change_crack(Simulation<Dim>& simulation, Random& random, Expectation& expected) {
  using V = Vec<Dim> CrackPoint<Dim>::*;
  auto& patches = simulation.patches();
  std::vector<std::pair<std::size_t, std::size_t>> own;  // patch, place in its list
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (std::size_t k = 0; k < patches[p].cracks.size(); ++k)
      if (patches[p].cracks[k].own) own.emplace_back(p, k);
  const auto [patch, place] = random.any(own);
  CrackPoint<Dim>& point = patches[patch].cracks[place];
  const Crack& crack = simulation.cracks()[point.crack];
  const V vector = random.any(std::vector<V>{&CrackPoint<Dim>::plane, &CrackPoint<Dim>::lower, &CrackPoint<Dim>::upper,
                                             &CrackPoint<Dim>::lower_velocity, &CrackPoint<Dim>::upper_velocity});
  const std::string which = fmt::format("crack {}, point {}: ", point.crack, point.index);
  const double huge = random.any(std::vector<double>{1, 1e6, 1e150, 1e300});
  expected = Expectation::refused;
  switch (random.below(14)) {
    case 0:
      (point.*vector)[static_cast<int>(random.below(Dim))] = random.any(std::vector<double>{nan, infinity, -infinity});
      return which + "a vector that is not finite";
    case 1:
      point.shift(Vec<Dim>::Constant(random.any(std::vector<double>{0.5, -0.5, 1e18, 1e300})));
      return which + "in another patch";
    case 2:
      (random.below(2) ? point.lower : point.upper)[0] += huge;
      return which + "a plane that is not between the faces";
    case 3:
      point.index = random.any(std::vector<int>{crack.ends[0] - 1, crack.ends[1] + 1, 1 << 30});
      return which + "an index that there is not";
    case 4:
      point.crack = random.any(std::vector<int>{-1, 99, 1 << 30});
      return which + "of no crack";
    case 5:
      point.next = random.any(std::vector<int>{point.index - 1, crack.ends[1] + 1, std::numeric_limits<int>::min()});
      return which + "the next one";
    case 6:
      point.bond.state = static_cast<Bond::State>(random.any(std::vector<int>{-1, 3, 1 << 30}));
      return which + "the state of its law";
    case 7:
      (random.below(2) ? point.bond.length : point.bond.peak[1]) = random.any(std::vector<double>{nan, infinity, -1});
      return which + "a number of its law";
    case 8:
      point.image[1] = 3;  // not periodic
      return which + "an image";
    case 9:
      point.faces_filled = random.any(std::vector<int>{-1, 4, 1 << 30});
      return which + "its faces";
    case 10:  // what a run may do
      expected = Expectation::any;
      point.lower -= Vec<Dim>::Constant(huge), point.upper += Vec<Dim>::Constant(huge);
      return which + fmt::format("open by {}", huge);
    case 11:
      expected = Expectation::any;
      point.velocity(random.below(2) ? 1 : -1).setConstant(huge);
      return which + fmt::format("as fast as {}", huge);
    case 12:
      expected = Expectation::any;
      patches[patch].cracks.erase(patches[patch].cracks.begin() + static_cast<std::ptrdiff_t>(place));
      return which + "left out";
    default:
      expected = Expectation::any;
      point.bond = {Bond::State{static_cast<int>(random.below(3))}, huge, {huge, huge}, huge};
      return which + fmt::format("a law after {}", huge);
  }
}

/// Changes what a patch has summed: its ledger, or what its tools felt.
template <int Dim>
std::string change_sums(Simulation<Dim>& simulation, Random& random, Expectation& expected) {
  auto& patches = simulation.patches();
  Patch<Dim>& patch = patches[random.any(filled(patches)).patch];
  const double value = random.any(std::vector<double>{nan, infinity, -infinity});
  expected = Expectation::refused;
  if (random.below(2) == 0) {
    const LedgerColumn& column = ledger_columns[random.below(std::size(ledger_columns))];
    patch.ledger.*column.value = value;
    return fmt::format("{} = {}", column.name, value);
  }
  const auto tools = static_cast<int>(simulation.tools().size());
  const int tool = random.any(std::vector<int>{0, tools - 1, tools, -1, std::numeric_limits<int>::min()});
  patch.tools[tool].total[random.below(ToolSum::size)] = value;
  return fmt::format("of tool {}: {}", tool, value);
}

/// Changes the tables of the state that are of the case's stages, tools, cracks and bodies to come.
std::string change_lists(RunState& state, Random& random, Expectation& expected) {
  struct List {
    const char* name;
    std::vector<double>& values;
    std::size_t row;
    bool may_be_short;  // a shorter one is that of another run
  };
  const List lists[] = {{"stage", state.stage, 1, false},
                        {"pouring", state.pouring, 1, false},
                        {"tools", state.tools, tool_state_size, false},
                        {"cracks", state.cracks, Crack::state_size, false},
                        {"parts", state.parts, 1, true},
                        {"spared", state.spared, 2, true}};
  std::vector<const List*> filled;
  for (const List& list : lists)
    if (!list.values.empty()) filled.push_back(&list);
  const List& list = *random.any(filled);
  const std::size_t at = random.below(list.values.size());
  expected = Expectation::refused;
  switch (random.below(4)) {
    case 0: {
      const double value = random.any(std::vector<double>{nan, infinity, -infinity});
      list.values[at] = value;
      return fmt::format("{} of {} = {}", at, list.name, value);
    }
    case 1:
      expected = list.may_be_short ? Expectation::any : Expectation::refused;
      list.values.resize(random.below(2) ? list.values.size() - list.row : 0);
      return fmt::format("{} cut short", list.name);
    case 2:
      expected = list.may_be_short ? Expectation::any : Expectation::refused;
      list.values.resize(list.values.size() + list.row * random.any(std::vector<std::size_t>{1, 2, 1000}), 1.0);
      return fmt::format("{} made longer", list.name);
    default:
      expected = Expectation::any;
      list.values[at] = random.any(std::vector<double>{-1, 0, 0.5, 1, 2, 5, 100, 1e9, -1e9, 1e18, 1e300, -1e300});
      return fmt::format("{} of {} = {}", at, list.name, list.values[at]);
  }
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
std::string change_state(const Seed<Dim>& seed, const std::filesystem::path& file, Random& random,
                         Expectation& expected) {
  const Checkpoint good(seed.file, MPI_COMM_SELF);
  Resumed<Dim> resumed(seed.spec, &good);
  Simulation<Dim>& simulation = resumed.simulation;
  RunState state = seed.state;
  std::string text = seed.spec.resolved, what;
  expected = Expectation::refused;
  switch (random.below(10)) {
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
    case 5:
      what = change_sums(simulation, random, expected);
      break;
    case 6:
    case 7:
      what = change_lists(state, random, expected);
      break;
    case 8:
      if (simulation.cracks().empty())
        what = change_lists(state, random, expected);
      else
        what = change_crack(simulation, random, expected);
      break;
    default:
      what = change_text(text, random, expected);
  }
  write_checkpoint(file, simulation, state, text);
  return what;
}

template std::string change_state(const Seed<2>&, const std::filesystem::path&, Random&, Expectation&);
template std::string change_state(const Seed<3>&, const std::filesystem::path&, Random&, Expectation&);

}  // namespace cairn::fuzz
