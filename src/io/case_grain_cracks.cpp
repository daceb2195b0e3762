// Cracks in grains: one entry of [[cracks]] for many, from a table or at random.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <random>

#include "cairn/body/crack_point.hpp"
#include "cairn/core/error.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

constexpr std::string_view header = "grain,x,y,angle,length";

/// A row of the table: the middle of the crack from that of the grain.
struct GrainCrack {
  int grain = 0;
  double x = 0, y = 0, angle = 0, length = 0;  // [m], [rad], [m]
  std::string source;
};

/// The end of a line that starts inside a shape: itself where it lies inside, else a little beyond the surface.
struct LineEnd {
  Vec3 x;
  CrackEnd kind;
};
LineEnd end_of(const Shape& shape, const Vec3& middle, const Vec3& end, double cell) {
  if (contains(shape, end)) return {end, CrackEnd::tip};
  double inside = 0, outside = 1;
  for (int i = 0; i < 40; ++i) {
    const double at = 0.5 * (inside + outside);
    (contains(shape, middle + at * (end - middle)) ? inside : outside) = at;
  }
  return {middle + outside * (end - middle) + 0.25 * cell * (end - middle).normalized(), CrackEnd::open};
}

std::string place(const GrainCrack& row, CrackSpec crack, Case& c) {
  if (row.grain < 0 || row.grain >= std::ssize(c.bodies))
    return fmt::format("{}: body {} does not exist; the bodies are 0 to {}", row.source, row.grain,
                       std::ssize(c.bodies) - 1);
  const Shape& shape = c.bodies[row.grain].shape;
  if (is_prescribed(c, row.grain)) return fmt::format("{}: body {} is rigid and cannot crack", row.source, row.grain);
  const Vec3 middle = centre(shape) + Vec3(row.x, row.y, 0);
  if (!contains(shape, middle))
    return fmt::format(
        "{}: the middle of the crack, {:.6g}, {:.6g} m, lies outside body {}; x and y count from the "
        "body's centre",
        row.source, middle.x(), middle.y(), row.grain);
  if (!(row.length > 0)) return fmt::format("{}: the length must be above 0", row.source);
  const Vec3 half = 0.5 * row.length * Vec3(std::cos(row.angle), std::sin(row.angle), 0);
  const double cell = smallest_cell(c.domain);
  const LineEnd first = end_of(shape, middle, middle - half, cell), last = end_of(shape, middle, middle + half, cell);
  crack.points = {first.x, last.x}, crack.ends = {first.kind, last.kind};
  for (Vec3& x : crack.points)
    x.head<2>() = x.head<2>().cwiseMax(c.domain.lower.head<2>()).cwiseMin(c.domain.upper.head<2>());
  crack.groups.clear(), crack.ids = {row.grain}, crack.source = row.source;
  c.cracks.push_back(std::move(crack));
  return {};
}

std::vector<GrainCrack> read_rows(const std::filesystem::path& file, std::vector<std::string>& problems) {
  const std::string text = read_text(file, "a table of cracks (CSV)");
  std::vector<GrainCrack> rows;
  bool named = false;
  int line = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string row = text.substr(begin, end - begin);
    begin = end + 1, ++line;
    std::erase_if(row, [](char ch) { return ch == ' ' || ch == '\t' || ch == '\r'; });
    if (row.empty() || row.front() == '#') continue;
    if (!named && row != header) {
      problems.push_back(fmt::format("{}:{}: the header must be {}", file.string(), line, header));
      return {};
    }
    if (!std::exchange(named, true)) continue;
    double values[5];
    int count = 0;
    const char* at = row.data();
    for (const char* const stop = row.data() + row.size(); count < 5; ++count) {
      const auto [next, status] = std::from_chars(at, stop, values[count]);
      if (status != std::errc{} || !std::isfinite(values[count]) || (next != stop && *next != ',')) break;
      if (next == stop) {
        ++count, at = next;
        break;
      }
      at = next + 1;
    }
    if (count != 5 || at != row.data() + row.size() || values[0] != std::floor(values[0]) || std::abs(values[0]) > 1e9)
      problems.push_back(fmt::format("{}:{}: must be five numbers, {}", file.string(), line, header));
    else
      rows.push_back({static_cast<int>(values[0]), values[1], values[2], values[3], values[4],
                      fmt::format("{}:{}", file.string(), line)});
  }
  if (rows.empty() && problems.empty()) problems.push_back(fmt::format("{}: holds no cracks", file.string()));
  return rows;
}

/// One crack in each of `count` bodies, chosen and laid by the seed alone.
std::vector<GrainCrack> random_rows(Table& table, const CrackSpec& crack, const Case& c, int count) {
  std::mt19937_64 engine(static_cast<std::uint64_t>(table.integer("seed", 1, 0, 1'000'000'000)));
  const auto uniform = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
  std::vector<double> lengths = {0.5, 0.5};
  if (table.has("length")) lengths = table.numbers("length", positive);
  if (lengths.size() != 2 || !(lengths[0] <= lengths[1])) {
    table.error("length", "must hold two shares of the bodies' widths, the smaller first");
    return {};
  }
  std::vector<int> bodies;
  for (int b = 0; b < std::ssize(c.bodies); ++b)
    if (crack.cuts(b, c.bodies[b].group) && !is_prescribed(c, b)) bodies.push_back(b);
  if (count > std::ssize(bodies)) {
    table.error("random", fmt::format("{} cracks are more than the {} bodies that may have one", count, bodies.size()));
    return {};
  }
  std::vector<GrainCrack> rows;
  for (int i = 0; i < count; ++i) {
    std::swap(bodies[i], bodies[i + static_cast<int>(uniform() * static_cast<double>(std::ssize(bodies) - i))]);
    GrainCrack row;
    row.grain = bodies[i], row.angle = M_PI * uniform();
    const double width = smallest_width(c.bodies[row.grain].shape);
    row.length = width * (lengths[0] + uniform() * (lengths[1] - lengths[0]));
    row.source = fmt::format("{}, body {}", crack.source, row.grain);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

void read_grain_cracks(Table table, const CrackSpec& crack, Draft& draft) {
  Case& c = draft.result;
  if (table.has("file") == table.has("random"))
    return table.error("", "needs either `file`, a table of cracks, or `random`, their number");
  std::vector<GrainCrack> rows;
  std::vector<std::string> problems;
  if (table.has("random")) {
    rows = random_rows(table, crack, c, static_cast<int>(table.integer("random", 1, 1, SideSet::most_cracks)));
  } else {
    const std::filesystem::path file = table.text("file", std::nullopt);
    try {
      rows = read_rows(file.is_absolute() ? file : c.file.parent_path() / file, problems);
    } catch (const InputError& error) {
      problems.emplace_back(error.what());
    }
  }
  table.finish();
  if (draft.bodies_known && draft.domain_known)
    for (const GrainCrack& row : rows)
      if (const std::string problem = place(row, crack, c); !problem.empty()) problems.push_back(problem);
  constexpr std::size_t most = 20;
  for (std::size_t i = 0; i < std::min(most, problems.size()); ++i) table.error("", problems[i]);
}

}  // namespace cairn::reading
