// Grain tables: CSV with a header line, columns x, y[, z], r[, vx, vy[, vz]][, material][, group][, clump] in any
// order;
// '#' starts a comment line. Rows of one clump are one body.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "cairn/core/error.hpp"
#include "cairn/core/memory.hpp"
#include "cairn/io/checksum.hpp"
#include "case_sections.hpp"

namespace cairn::reading {
namespace {

constexpr std::size_t most_errors = 20;  // reported for one table

enum Column { x, y, z, r, vx, vy, vz, material, group, clump, column_count };
constexpr std::string_view column_names[column_count] = {"x",  "y",  "z",        "r",     "vx",
                                                         "vy", "vz", "material", "group", "clump"};

std::string_view trimmed(std::string_view s) {
  const auto first = s.find_first_not_of(" \t\r");
  return first == std::string_view::npos ? std::string_view{}
                                         : s.substr(first, s.find_last_not_of(" \t\r") - first + 1);
}

void split(std::string_view line, std::vector<std::string_view>& cells) {
  cells.clear();
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find(',', begin);
    cells.push_back(trimmed(line.substr(begin, end - begin)));
    if (end == std::string_view::npos) return;
    begin = end + 1;
  }
}

class GrainTable {
 public:
  GrainTable(const std::filesystem::path& file, const GrainsSpec& spec, Draft& draft, Errors& errors)
      : name_(file.string()), spec_(spec), draft_(draft), errors_(errors), dimension_(draft.result.domain.dimension) {}

  void read(std::string_view text) {
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::string_view line = trimmed(text.substr(begin, end - begin));
      begin = end + 1;
      ++line_;
      if (line.empty() || line.front() == '#') continue;
      split(line, cells_);
      if (width_ == 0) {
        if (!read_header()) return;
      } else {
        read_row();
      }
    }
    check_clumps();
    if (width_ == 0) return problem("", "there is no header line; the first line must be " + header());
    if (rows_ == 0) problem("", "holds no grains; give at least one row " + header());
    if (found_ > most_errors) errors_.add({name_, 0}, "", fmt::format("... and {} more", found_ - most_errors));
  }

 private:
  std::string header() const {
    return dimension_ == 2 ? "x,y,r[,vx,vy][,material][,group][,clump]"
                           : "x,y,z,r[,vx,vy,vz][,material][,group][,clump]";
  }

  void problem(std::string_view key, std::string_view text) {
    if (++found_ <= most_errors) errors_.add({name_, std::max<std::int64_t>(line_, 1)}, key, text);
  }

  bool read_header() {
    const std::size_t before = found_;
    std::ranges::fill(position_, -1);
    for (std::size_t i = 0; i < cells_.size() && found_ < before + 3; ++i) {
      const auto column = std::ranges::find(column_names, cells_[i]) - std::begin(column_names);
      if (column == column_count) {
        problem("", fmt::format("{} is not a column; the nearest is '{}'; the header must be {}", in_quotes(cells_[i]),
                                nearest(cells_[i], column_names), header()));
      } else if (position_[column] >= 0) {
        problem(column_names[column], "this column is named twice; name it once");
      } else {
        position_[column] = static_cast<int>(i);
      }
    }
    if (found_ != before) return false;
    for (const Column c : {z, vz})
      if (dimension_ == 2 && position_[c] >= 0)
        problem(column_names[c], "this column belongs to 3D; the header must be " + header());
    const int speeds = (position_[vx] >= 0) + (position_[vy] >= 0) + (position_[vz] >= 0);
    if (speeds != 0 && speeds != dimension_)
      problem("vx", "a velocity needs all its columns; the header must be " + header());
    for (const Column c : {x, y, z, r})
      if (position_[c] < 0 && (c != z || dimension_ == 3))
        problem(column_names[c], "this column is missing; the header must be " + header());
    width_ = cells_.size();
    return found_ == before;
  }

  double number(Column c, const Range& range) {
    std::string_view cell = cells_[position_[c]];
    if (cell.starts_with('+')) cell.remove_prefix(1);
    double value = 0;
    const auto [end, status] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (end != cell.data() + cell.size() || status == std::errc::invalid_argument) {
      problem(column_names[c], fmt::format("{} is not a number; {}", in_quotes(cell), range.text()));
    } else if (status != std::errc{} || !range.holds(value)) {
      problem(column_names[c], fmt::format("{} is out of range; {}", std::string(cell.substr(0, 40)), range.text()));
    }
    return value;
  }

  std::string_view word(Column c) const { return position_[c] < 0 ? std::string_view{} : cells_[position_[c]]; }

  int row_material() {
    const std::string_view name = word(material);
    if (name.empty()) {
      if (spec_.material < 0) problem("material", "is missing; name it in the row, or for all rows in [[grains]]");
      return std::max(0, spec_.material);
    }
    const int found = find_material(draft_.result.materials, name);
    if (found < 0)
      problem("material", fmt::format("{} is not a material; known are {}", in_quotes(name),
                                      material_list(draft_.result.materials)));
    return std::max(0, found);
  }

  void read_row() {
    ++rows_;
    const std::size_t before = found_;
    BodySpec body;
    Ball ball{Vec3::Zero(), 0};
    if (cells_.size() != width_) {
      problem("", fmt::format("has {} values; the header names {} columns", cells_.size(), width_));
    } else {
      ball.centre = {number(x, any_finite), number(y, any_finite), dimension_ == 3 ? number(z, any_finite) : 0.0};
      ball.radius = number(r, positive);
      body.material = row_material();
      body.group = word(group).empty() ? spec_.group : std::string(word(group));
    }
    body.shape = ball;
    body.velocity = spec_.velocity;
    if (found_ == before && position_[vx] >= 0)
      body.velocity = {number(vx, any_finite), number(vy, any_finite), dimension_ == 3 ? number(vz, any_finite) : 0.0};
    const std::string together(word(clump));
    if (found_ == before && together.empty() && draft_.domain_known) {
      const std::string misplaced = placement_problem(body.shape, draft_.result.domain);
      if (!misplaced.empty()) problem("", misplaced);
    }
    if (found_ == before && !together.empty() && joined(together, body)) return;
    body.angular_velocity = spec_.angular_velocity;
    body.initial_pressure = spec_.initial_pressure;
    body.source = name_ + ":" + std::to_string(line_);
    draft_.result.bodies.push_back(std::move(body));
  }

  /// Adds the ball to the body of its clump; false where it is the first of it.
  bool joined(const std::string& together, const BodySpec& body) {
    const auto [entry, fresh] = clumps_.try_emplace(together, draft_.result.bodies.size());
    if (fresh) return false;
    BodySpec& first = draft_.result.bodies[entry->second];
    if (first.material != body.material || first.velocity != body.velocity)
      problem("clump",
              fmt::format("has another material or velocity than the first row of its clump, {}", first.source));
    if (!std::holds_alternative<Compound>(first.shape))
      first.shape = Compound{CompoundOperation::union_of, {first.shape}};
    std::get<Compound>(first.shape).of.push_back(body.shape);
    return true;
  }

  /// Clumps can be looked at only when they are whole.
  void check_clumps() {
    if (!draft_.domain_known) return;
    for (const auto& [together, body] : clumps_) {
      const std::string misplaced = placement_problem(draft_.result.bodies[body].shape, draft_.result.domain);
      if (!misplaced.empty()) problem("clump", fmt::format("{}: {}", in_quotes(together), misplaced));
    }
  }

  std::string name_;
  const GrainsSpec& spec_;
  Draft& draft_;
  Errors& errors_;
  int dimension_;
  std::int64_t line_ = 0;
  std::size_t width_ = 0, rows_ = 0, found_ = 0;
  int position_[column_count] = {};
  std::map<std::string, std::size_t> clumps_;  // where their bodies are
  std::vector<std::string_view> cells_;
};

/// Makes room for the rows of a table. \throws InputError "FILE: ..." where there is not that much memory
void make_room(const std::filesystem::path& file, std::string_view text, std::vector<BodySpec>& bodies) {
  constexpr double more =
      250;  // of a body: where it was read, its place in the search for overlaps, what the solver knows
  const auto rows = std::ranges::count(text, '\n') + 1;
  const double needed = static_cast<double>(rows) * (sizeof(BodySpec) + more);
  const double there = std::min(available_memory() / ranks_on_machine(), memory_limit());
  if (needed > there)
    throw InputError(
        fmt::format("{}: holds {} lines, which need at least {:.3g} GB of memory on every rank; there are "
                    "{:.3g} GB; use fewer grains or ranks, or more machines",
                    file.string(), rows, 1e-9 * needed, 1e-9 * there));
  bodies.reserve(bodies.size() + static_cast<std::size_t>(rows));
}

}  // namespace

std::uint64_t read_grain_table(const std::filesystem::path& file, const GrainsSpec& spec, Draft& draft,
                               Errors& errors) {
  try {
    const std::string text = read_text(file, "a grain table (CSV)");
    make_room(file, text, draft.result.bodies);
    GrainTable(file, spec, draft, errors).read(without_mark(text));
    return checksum(std::span<const char>(text));
  } catch (const InputError& error) {  // the file cannot be read
    const std::string_view message = error.what();
    errors.add({file.string(), 0}, "", message.substr(std::min(message.size(), file.string().size() + 2)));
  }
  return 0;
}

}  // namespace cairn::reading
