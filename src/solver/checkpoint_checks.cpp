#include "checkpoint_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "cairn/body/deformation.hpp"
#include "cairn/io/checksum.hpp"
#include "cairn/io/result_files.hpp"
#include "cairn/parallel/crack_exchange.hpp"
#include "cairn/parallel/migration.hpp"
#include "checkpoint_columns.hpp"

namespace cairn::checkpoint {
namespace {

/// Least and largest value of a number of the state, by the end of its name; the first that fits holds.
struct Limits {
  const char* ending;
  double least, most;
};

std::string problem_of_numbers(const RunState& state) {
  constexpr double any = std::numeric_limits<double>::max();
  const auto steps = static_cast<double>(state.step.steps);
  const double time = state.step.time;
  const Limits limits[] = {{"_last_step", -1, steps},
                           {"_last_time", -1, time},
                           {"_last_wall", 0, any},
                           {"_count", 0, steps + 2},
                           {"_bytes", 0, any},
                           {"dt", 0, any},
                           {"_speed", 0, any},
                           {"kinetic", 0, any},
                           {"kinetic_before", 0, any},
                           {"energy_started", 0, 1},
                           {"energy_largest", 0, any},
                           {"contacts_cleared", 0, time},
                           {"contacts_kept", 0, 1},
                           {"wall", 0, any},
                           {"energy_initial", -any, any},
                           {"_potential", -any, any},
                           {"energy_error", -any, any},
                           {"", -any, any}};
  std::string problem;
  for_each_number(state, [&]<class T>(const std::string& name, const T& number) {
    if constexpr (!std::is_same_v<T, std::uint64_t>) {
      const Limits* limit = limits;
      while (!name.ends_with(limit->ending)) ++limit;
      const auto value = static_cast<double>(number);
      if (problem.empty() && !(value >= limit->least && value <= limit->most))
        problem = fmt::format("its number {} = {} is not in [{}, {}]", name, value, limit->least, limit->most);
    }
  });
  return problem;
}

std::string problem_of_series(const RunState& state) {
  std::int64_t next = 0;
  double earliest = 0;
  for (const auto& [name, time] : state.series) {
    while (next < state.particles.count && numbered_name("particles", next) != name) ++next;
    if (next++ >= state.particles.count)
      return fmt::format(
          "its list of particle files has the entry '{}', which is none of the {} written, in their order", name,
          state.particles.count);
    if (!(time >= earliest && time <= state.step.time))
      return fmt::format("its list of particle files has {} at the time {} s, before its predecessor or after now",
                         name, time);
    earliest = time;
  }
  return {};
}

}  // namespace

std::string problem_of(const RunState& state) {
  if (!(state.step.time >= 0 && std::isfinite(state.step.time)) || state.step.steps < 0)
    return fmt::format("its step {} or time {} s is none that a run reaches", state.step.steps, state.step.time);
  for (const double number : state.stage)
    if (!std::isfinite(number)) return "the state of its stage is not finite";
  for (const double number : state.pouring)
    if (!std::isfinite(number)) return "the state of its pouring is not finite";
  for (const double number : state.tools)
    if (!std::isfinite(number)) return "the state of a tool is not finite";
  const std::string problem = problem_of_numbers(state);
  return problem.empty() ? problem_of_series(state) : problem;
}

std::string problem_of(const char* name, const std::vector<std::int64_t>& counts, std::int64_t rows) {
  std::int64_t left = rows;
  for (std::size_t p = 0; p < counts.size(); left -= counts[p++])
    if (counts[p] < 0 || counts[p] > left)
      return fmt::format("its column {} gives patch {} {} rows, where {} are left", name, p, counts[p], left);
  return left == 0 ? "" : fmt::format("its column {} leaves {} of {} rows to no patch", name, left, rows);
}

template <int Dim>
std::string problem_of(const Piece<Dim>& piece, const Lattice<Dim>& lattice, PatchId patch) {
  using C = PointColumns<Dim>;
  const Points<Dim>& points = piece.points;
  const auto wrong = [&](int p, const char* what) {
    return fmt::format("point {} of body {} in patch {} {}", points.ids()[p], piece.body, patch, what);
  };
  for (int c = 0; c < points.columns(); ++c)
    for (int p = 0; p < points.size(); ++p)
      if (!std::isfinite(points.column(c)[p])) return wrong(p, "has a value that is not finite");
  for (int p = 0; p < points.size(); ++p) {
    if (!(points.column(C::volume)[p] > 0)) return wrong(p, "has no volume");
    if (!(volume_ratio(points, p) > 0)) return wrong(p, "is inverted");
    if (points.ids()[p] < 0) return wrong(p, "has a negative number");
    for (int d = 0; d < static_cast<int>(points.images()[p].size()); ++d)
      if (points.images()[p][d] != 0 && (d >= Dim || !lattice.periodic(d)))
        return wrong(p, "has crossed a boundary that is not periodic");
  }
  return all_inside(piece, lattice, patch)
             ? ""
             : fmt::format("body {} has points in patch {} that do not lie there", piece.body, patch);
}

template <int Dim>
std::string problem_of(std::pair<int, int> bodies, const ContactSum<Dim>& sum, std::size_t body_count,
                       std::size_t partner_count) {
  const auto& [a, b] = bodies;
  if (a < 0 || a >= b || static_cast<std::size_t>(a) >= body_count || static_cast<std::size_t>(b) >= partner_count)
    return fmt::format("it holds a contact of bodies {} and {}; the case has {} bodies", a, b, body_count);
  for (const double value : sum.values)
    if (!std::isfinite(value)) return fmt::format("the contact of bodies {} and {} is not finite", a, b);
  return sum.values[0] >= 0 ? "" : fmt::format("the contact of bodies {} and {} has a negative weight", a, b);
}

template <int Dim>
std::string problem_of(const std::int32_t* numbers, const double* bond, const Crack& crack,
                       const Lattice<Dim>& lattice) {
  const auto wrong = [&](const char* what) {
    return fmt::format("point {} of crack {} {}", numbers[crack_index], numbers[crack_of], what);
  };
  const auto is_within = [&](CrackNumber which, int least, int most) {
    return numbers[which] >= least && numbers[which] <= most;
  };
  if (!is_within(crack_index, crack.ends[0], crack.ends[1])) return wrong("is none that the case has");
  if (!is_within(crack_next, numbers[crack_index], crack.ends[1])) return wrong("is followed by one that there is not");
  if (!is_within(crack_filled, 0, 1) || !is_within(crack_faces_filled, 0, 3) || !is_within(bond_state, 0, Bond::broken))
    return wrong("is in a state that there is not");
  for (int d = 0; d < image_components; ++d)
    if (numbers[crack_image + d] != 0 && (d >= Dim || !lattice.periodic(d)))
      return wrong("has crossed a boundary that is not periodic");
  const bool good = std::all_of(bond, bond + bond_numbers, [](double x) { return std::isfinite(x) && x >= 0; });
  return good ? "" : wrong("has a law that is not finite, or negative");
}

template <int Dim>
std::string problem_of(const CrackPoint<Dim>& point, const Lattice<Dim>& lattice, const Patch<Dim>& patch) {
  const auto wrong = [&](const char* what) {
    return fmt::format("point {} of crack {} in patch {} {}", point.index, point.crack, patch.id, what);
  };
  for (const auto& vector : crack_vectors<Dim>)
    if (!(point.*vector.value).allFinite()) return wrong("is not finite");
  if (!holds(patch, lattice, point)) return wrong("does not lie there");
  double size = 0;  // of the domain [m]
  for (int d = 0; d < Dim; ++d) size = std::max({size, lattice.length(d), std::abs(lattice.lower()[d])});
  const Vec<Dim> middle = 0.5 * point.lower + 0.5 * point.upper;
  return (point.plane - middle).cwiseAbs().maxCoeff() <= 1e-9 * size ? "" : wrong("does not lie between its faces");
}

std::uint64_t checksum_of(const RunState& state, const std::string& case_text) {
  Checksum sum;
  const auto add = [&]<class T>(const std::string& name, const T& value) {
    sum.add_values(std::span(name.data(), name.size() + 1));
    sum.add_values(std::span<const T>(&value, 1));
  };
  add("time", state.step.time), add("step", state.step.steps);
  for_each_number(state, add);
  for (const auto& entry : state.series) add(entry.name, entry.time);
  for (const auto* values : {&state.stage, &state.pouring, &state.tools, &state.cracks, &state.parts, &state.spared})
    sum.add_values(std::span(*values));
  add("case", std::ssize(case_text));
  sum.add_values(std::span(case_text.data(), case_text.size()));
  return sum.value();
}

#define CAIRN_INSTANTIATE(Dim)                                                                            \
  template std::string problem_of(const Piece<Dim>&, const Lattice<Dim>&, PatchId);                       \
  template std::string problem_of(std::pair<int, int>, const ContactSum<Dim>&, std::size_t, std::size_t); \
  template std::string problem_of(const std::int32_t*, const double*, const Crack&, const Lattice<Dim>&); \
  template std::string problem_of(const CrackPoint<Dim>&, const Lattice<Dim>&, const Patch<Dim>&);
CAIRN_INSTANTIATE(2)
CAIRN_INSTANTIATE(3)
#undef CAIRN_INSTANTIATE

}  // namespace cairn::checkpoint
