#include "case_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "cairn/core/error.hpp"
#include "cairn/core/printable.hpp"

namespace cairn::reading {

void Errors::add(const Location& where, std::string_view key, std::string_view text) {
  const bool repeated = key.empty() || (where.is_override() && where.file.substr(6) == key);
  entries_.push_back({where, repeated ? fmt::format("{}: {}", where.text(), text)
                                      : fmt::format("{}: {}: {}", where.text(), key, text)});
}

void Errors::throw_if_any() {
  if (entries_.empty()) return;
  const auto order = [this](const Entry& e) {
    if (e.where.file == main_file_) return std::tuple(0, e.where.line);
    return std::tuple(e.where.is_override() ? 1 : 2, std::int64_t{0});
  };
  std::ranges::stable_sort(entries_, {}, order);
  std::vector<std::string> messages;
  for (const auto& entry : entries_) messages.push_back(entry.text);
  throw InputError(messages);
}

bool Range::holds(double value) const {
  if (std::isnan(value) || (std::isinf(value) && !infinite)) return false;
  return (lower_open ? value > lower : value >= lower) && (upper_open ? value < upper : value <= upper);
}

std::string Range::text() const {
  if (lower == -infinity && upper == infinity) return "must be a finite number";
  if (upper == infinity)
    return fmt::format("must be {} {}{}", lower_open ? "greater than" : "at least", lower,
                       infinite ? " (inf is allowed)" : "");
  return fmt::format("must be in {}{}, {}{}", lower_open ? '(' : '[', lower, upper, upper_open ? ')' : ']');
}

namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row.back();
}

/// What a node is, in words for a message.
std::string_view kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::integer:
      return "an integer";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date or time";
  }
}

}  // namespace

std::string_view nearest(std::string_view word, std::span<const std::string_view> known) {
  if (known.empty()) return {};
  word = word.substr(0, 100);
  return *std::ranges::min_element(known, {}, [&](std::string_view k) { return edit_distance(word, k); });
}

std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  result += printable(text.substr(0, 60));
  return result + (text.size() > 60 ? "...\"" : "\"");
}

std::string listed(std::span<const std::string_view> names) { return fmt::format("{}", fmt::join(names, ", ")); }

Location location_of(const toml::source_region& source, const Location& fallback) {
  if (!source.path || source.begin.line == 0) return fallback;
  Location where{*source.path, static_cast<std::int64_t>(source.begin.line)};
  if (where.is_override()) where.line = 0;
  return where;
}

std::string Table::path_of(std::string_view key) const {
  if (path_.empty() || key.empty()) return path_ + std::string(key);
  return path_ + "." + std::string(key);
}

const toml::node* Table::find(std::string_view key) {
  if (std::ranges::find(known_, key) == known_.end()) known_.emplace_back(key);
  return table_ ? table_->get(key) : nullptr;
}

bool Table::has(std::string_view key) { return find(key) != nullptr; }

std::vector<std::string> Table::keys() const {
  struct Entry {
    bool overridden;
    std::uint32_t line, column;
    std::string name;
  };
  std::vector<Entry> entries;
  if (table_)
    for (auto&& [key, node] : *table_) {
      const auto begin = key.source().begin ? key.source().begin : node.source().begin;
      const bool overridden = location_of(node.source(), where_).is_override() && !key.source().begin;
      entries.push_back({overridden, begin.line, begin.column, std::string(key.str())});
    }
  std::ranges::stable_sort(entries, {}, [](const Entry& e) { return std::tuple(e.overridden, e.line, e.column); });
  std::vector<std::string> names;
  for (auto& e : entries) names.push_back(std::move(e.name));
  return names;
}

Location Table::where(std::string_view key) const {
  const toml::node* node = table_ && !key.empty() ? table_->get(key) : nullptr;
  return node ? location_of(node->source(), where_) : where_;
}

void Table::error(std::string_view key, std::string_view text) { errors_->add(where(key), path_of(key), text); }

void Table::missing(std::string_view key, std::string_view text) {
  if (!muted_) error(key, text);
}

void Table::finish() {
  if (!table_) return;
  const std::vector<std::string_view> known(known_.begin(), known_.end());
  for (auto&& [key, node] : *table_) {
    if (std::ranges::find(known, key.str()) != known.end()) continue;
    Location where = location_of(node.source(), where_);
    if (!where.is_override()) where = location_of(key.source(), where);
    std::string shown = in_quotes(key.str());
    shown = shown.substr(1, shown.size() - 2);
    errors_->add(where, path_of(shown),
                 fmt::format("unknown key; the nearest known key is '{}' (known here: {})", nearest(key.str(), known),
                             listed(known)));
  }
}

std::optional<double> Table::as_number(const toml::node& node, std::string_view key, const Range& range) {
  const Location at = location_of(node.source(), where(key));
  std::optional<double> value;
  if (node.is_integer()) value = static_cast<double>(node.as_integer()->get());
  if (node.is_floating_point()) value = node.as_floating_point()->get();
  if (!value) {
    errors_->add(at, path_of(key), fmt::format("is {}; {}", kind_of(node), range.text()));
  } else if (!range.holds(*value)) {
    errors_->add(at, path_of(key), fmt::format("{} is out of range; {}", *value, range.text()));
    value.reset();
  }
  return value;
}

double Table::number(std::string_view key, std::optional<double> fallback, const Range& range) {
  const toml::node* node = find(key);
  if (!node && !fallback) missing(key, fmt::format("is missing; it {}", range.text()));
  const double neutral = fallback.value_or(1.0);
  return node ? as_number(*node, key, range).value_or(neutral) : neutral;
}

std::int64_t Table::integer(std::string_view key, std::optional<std::int64_t> fallback, std::int64_t lower,
                            std::int64_t upper) {
  const toml::node* node = find(key);
  const bool open = upper == std::numeric_limits<std::int64_t>::max();
  const auto range = open ? fmt::format("must be an integer of at least {}", lower)
                          : fmt::format("must be an integer in [{}, {}]", lower, upper);
  const std::int64_t neutral = fallback.value_or(lower);
  if (!node) {
    if (!fallback) missing(key, "is missing; it " + range);
    return neutral;
  }
  if (!node->is_integer()) {
    error(key, fmt::format("is {}; {}", kind_of(*node), range));
    return neutral;
  }
  const std::int64_t value = node->as_integer()->get();
  if (value >= lower && value <= upper) return value;
  error(key, fmt::format("{} is out of range; {}", value, range));
  return neutral;
}

bool Table::boolean(std::string_view key, bool fallback) {
  const toml::node* node = find(key);
  if (node && !node->is_boolean()) error(key, fmt::format("is {}; must be true or false", kind_of(*node)));
  return node && node->is_boolean() ? node->as_boolean()->get() : fallback;
}

std::string Table::text(std::string_view key, const std::optional<std::string>& fallback) {
  const toml::node* node = find(key);
  if (!node) {
    if (!fallback) missing(key);
    return fallback.value_or("");
  }
  if (node->is_string()) return node->as_string()->get();
  error(key, fmt::format("is {}; must be a string in quotes", kind_of(*node)));
  return fallback.value_or("");
}

const toml::array* Table::list(std::string_view key, std::string_view what) {
  const toml::node* node = find(key);
  if (node && !node->is_array()) error(key, fmt::format("is {}; must be an array of {}", kind_of(*node), what));
  return node ? node->as_array() : nullptr;
}

Vec3 Table::as_vector(const toml::node& node, std::string_view key, int size, const Range& range) {
  Vec3 result = Vec3::Zero();
  const toml::array* array = node.as_array();
  const Location at = location_of(node.source(), where(key));
  if (!array) {
    errors_->add(at, path_of(key), fmt::format("is {}; must be an array of {} numbers", kind_of(node), size));
  } else if (std::ssize(*array) != size) {
    errors_->add(at, path_of(key),
                 fmt::format("has {} entries; must have {} numbers, one for each direction{}", array->size(), size,
                             size == 2 && array->size() == 3 ? "; a case in space has domain.dimension = 3" : ""));
  } else {
    for (int i = 0; i < size; ++i) result[i] = as_number(*array->get(i), key, range).value_or(1.0);
  }
  return result;
}

Vec3 Table::vector(std::string_view key, int size, const std::optional<Vec3>& fallback, const Range& range) {
  const toml::node* node = find(key);
  if (!node && !fallback) missing(key, fmt::format("is missing; it must be an array of {} numbers", size));
  return node ? as_vector(*node, key, size, range) : fallback.value_or(Vec3::Zero());
}

std::vector<Vec3> Table::vectors(std::string_view key, int size) {
  std::vector<Vec3> result;
  if (!has(key)) missing(key, fmt::format("is missing; it must be an array of points of {} numbers", size));
  if (const toml::array* array = list(key, "points"))
    for (const auto& node : *array) result.push_back(as_vector(node, key, size, any_finite));
  return result;
}

/// A number, or a formula of t.
Formula Table::as_formula(const toml::node& node, std::string_view key) {
  if (!node.is_string()) return Formula(fmt::format("{}", as_number(node, key, any_finite).value_or(0.0)));
  try {
    Formula formula(node.as_string()->get());
    formula.at(0);
    return formula;
  } catch (const std::exception& problem) {
    error(key, fmt::format("{} {}; write one such as \"0.1 * sin(2 * pi * t)\"", in_quotes(node.as_string()->get()),
                           problem.what()));
    return Formula("0");
  }
}

/// Rows of a time and a value.
MotionTable Table::as_rows(const toml::array& array, std::string_view key, int size) {
  MotionTable table;
  table.values.clear();
  for (const auto& entry : array) {
    const toml::array* row = entry.as_array();
    if (!row || std::ssize(*row) != 1 + size) {
      error(key, fmt::format("must have rows of {} numbers: a time and {}", 1 + size, size));
      return {};
    }
    const double time = as_number(*row->get(0), key, any_finite).value_or(0.0);
    if (!table.times.empty() && !(time > table.times.back())) {
      error(key, fmt::format("has the time {} after {}; times must ascend", time, table.times.back()));
      return {};
    }
    table.times.push_back(time);
    Vec3 value = Vec3::Zero();
    for (int i = 0; i < size; ++i) value[i] = as_number(*row->get(1 + i), key, any_finite).value_or(0.0);
    table.values.push_back(value);
  }
  return table;
}

MotionTable Table::motion(std::string_view key, int size) {
  const toml::node* node = find(key);
  if (!node) return {};
  const toml::array* array = node->as_array();
  if (array && !array->empty() && array->get(0)->is_array()) return as_rows(*array, key, size);
  const bool formula =
      size == 1 ? node->is_string()
                : array && std::ranges::any_of(*array, [](const toml::node& entry) { return entry.is_string(); });
  if (!formula && size == 1) return Vec3(as_number(*node, key, any_finite).value_or(0.0), 0, 0);
  if (!formula) return as_vector(*node, key, size, any_finite);
  if (size > 1 && std::ssize(*array) != size) {
    error(key, fmt::format("has {} entries; must have {} numbers or formulas", array->size(), size));
    return {};
  }
  MotionTable table;
  for (int i = 0; i < 3; ++i)
    table.formulas.push_back(i >= size ? Formula("0") : as_formula(size == 1 ? *node : *array->get(i), key));
  return table;
}

Vec3 Table::scalar_or_vector(std::string_view key, int size, const Range& range) {
  const toml::node* node = find(key);
  if (!node || node->is_array()) return vector(key, size, std::nullopt, range);
  Vec3 result = Vec3::Zero();
  const double value = as_number(*node, key, range).value_or(1.0);
  for (int i = 0; i < size; ++i) result[i] = value;
  return result;
}

std::array<bool, 3> Table::booleans(std::string_view key, int size) {
  std::array<bool, 3> result = {false, false, false};
  const toml::array* array = list(key, "true and false");
  if (!array) return result;
  const bool right =
      std::ssize(*array) == size && std::ranges::all_of(*array, [](const auto& n) { return n.is_boolean(); });
  if (!right) error(key, fmt::format("must have {} entries, each true or false, one for each direction", size));
  for (int i = 0; right && i < size; ++i) result[i] = array->get(i)->as_boolean()->get();
  return result;
}

std::vector<int> Table::integers(std::string_view key) {
  std::vector<int> result;
  if (const toml::array* array = list(key, "integers"))
    for (const auto& node : *array) {
      const std::int64_t value = node.is_integer() ? node.as_integer()->get() : -1;
      if (value < 0 || value > std::numeric_limits<int>::max()) {
        error(key, "must be an array of integers of at least 0");
        return {};
      }
      result.push_back(static_cast<int>(value));
    }
  return result;
}

std::vector<double> Table::numbers(std::string_view key, const Range& range) {
  std::vector<double> result;
  if (const toml::array* array = list(key, "numbers"))
    for (const auto& node : *array) result.push_back(as_number(node, key, range).value_or(1.0));
  return result;
}

std::vector<std::string> Table::texts(std::string_view key) {
  std::vector<std::string> result;
  if (const toml::array* array = list(key, "strings"))
    for (const auto& node : *array) {
      if (!node.is_string()) {
        error(key, fmt::format("holds {}; must be an array of strings", kind_of(node)));
        return {};
      }
      result.push_back(node.as_string()->get());
    }
  return result;
}

std::size_t Table::choose(std::string_view key, std::span<const std::string_view> names) {
  const toml::node* node = find(key);
  if (!node) return names.size();
  if (!node->is_string()) {
    error(key, fmt::format("is {}; must be a string, one of {}", kind_of(*node), listed(names)));
    return names.size();
  }
  const std::string& value = node->as_string()->get();
  const auto found = std::ranges::find(names, std::string_view(value));
  if (found == names.end())
    error(key, fmt::format("{} is not a choice; choose one of {}", in_quotes(value), listed(names)));
  return static_cast<std::size_t>(found - names.begin());
}

Table Table::table(std::string_view key) {
  const toml::node* node = find(key);
  if (node && !node->is_table()) error(key, fmt::format("is {}; must be a table", kind_of(*node)));
  Table result(node ? node->as_table() : nullptr, path_of(key), where(key), *errors_);
  result.muted_ = node && !node->is_table();
  return result;
}

std::vector<Table> Table::tables(std::string_view key) {
  std::vector<Table> result;
  const toml::node* node = find(key);
  if (node && node->is_table()) {
    error(key, fmt::format("is one table; must be an array of tables: write [[{}]]", path_of(key)));
    return result;
  }
  if (const toml::array* array = list(key, "tables"))
    for (std::size_t i = 0; i < array->size(); ++i) {
      const toml::node& entry = *array->get(i);
      const auto path = fmt::format("{}.{}", path_of(key), i);
      const Location at = location_of(entry.source(), where(key));
      if (!entry.is_table()) errors_->add(at, path, fmt::format("is {}; must be a table", kind_of(entry)));
      if (entry.is_table()) result.emplace_back(entry.as_table(), path, at, *errors_);
    }
  return result;
}

}  // namespace cairn::reading
