#pragma once
/// Reading toolkit for TOML files: typed access to keys with ranges and choices. Errors are collected, not thrown, so
/// that one report holds them all. A key that fails to read yields a neutral value and reading goes on.

#include <toml++/toml.h>

#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "cairn/core/types.hpp"
#include "cairn/io/case.hpp"

namespace cairn::reading {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// A line of a file, or an override ("--set KEY", line 0).
struct Location {
  std::string file;
  std::int64_t line = 0;
  bool is_override() const { return file.starts_with("--set "); }
  std::string text() const { return line > 0 ? file + ":" + std::to_string(line) : file; }
};

/// Collects errors; reports those of the main file in the order of its lines, then overrides, then other files.
class Errors {
 public:
  explicit Errors(std::string main_file) : main_file_(std::move(main_file)) {}
  void add(const Location& where, std::string_view key, std::string_view text);
  std::size_t count() const { return entries_.size(); }
  /// \throws InputError if there are any.
  void throw_if_any();

 private:
  struct Entry {
    Location where;
    std::string text;
  };
  std::string main_file_;
  std::vector<Entry> entries_;
};

/// Allowed values of a number. NaN is never allowed, infinity only where `infinite` says so.
struct Range {
  double lower = -infinity, upper = infinity;
  bool lower_open = false, upper_open = false, infinite = false;
  bool holds(double value) const;
  std::string text() const;  // "must be ..."
};
inline constexpr Range any_finite = {};
inline constexpr Range positive = {0, infinity, true, false, false};
inline constexpr Range not_negative = {0, infinity, false, false, false};
inline constexpr Range friction_range = {0, infinity, false, false, true};

/// A choice of the case file and what it stands for.
template <class E>
struct Named {
  std::string_view name;
  E value;
};

/// The entry of `known` with the least edit distance to `word`.
std::string_view nearest(std::string_view word, std::span<const std::string_view> known);

/// Text in quotes for a message: control characters replaced, cut when long.
std::string in_quotes(std::string_view text);

/// "a, b, c"
std::string listed(std::span<const std::string_view> names);

/// Where a TOML node was written; `fallback` for nodes without a position.
Location location_of(const toml::source_region& source, const Location& fallback);

/// A table of the file. Every access registers its key as known; `finish` reports the keys that nobody asked for.
class Table {
 public:
  Table(const toml::table* table, std::string path, Location where, Errors& errors)
      : table_(table), path_(std::move(path)), where_(std::move(where)), errors_(&errors) {}

  bool present() const { return table_ != nullptr; }
  bool has(std::string_view key);
  const toml::node* find(std::string_view key);
  /// Keys in the order of the file.
  std::vector<std::string> keys() const;

  /// Without a fallback the key is required.
  double number(std::string_view key, std::optional<double> fallback, const Range& range = any_finite);
  std::int64_t integer(std::string_view key, std::optional<std::int64_t> fallback, std::int64_t lower,
                       std::int64_t upper);
  bool boolean(std::string_view key, bool fallback);
  std::string text(std::string_view key, const std::optional<std::string>& fallback);
  /// Numbers [size] as a vector padded with zeros.
  Vec3 vector(std::string_view key, int size, const std::optional<Vec3>& fallback, const Range& range = any_finite);
  std::vector<Vec3> vectors(std::string_view key, int size);
  /// One number for each direction, or one for all.
  Vec3 scalar_or_vector(std::string_view key, int size, const Range& range);
  /// Numbers [size], or one where size is 1, any of them as a formula of t; or an array of rows of a time [s] and so
  /// many numbers. Zero where it is not given.
  MotionTable motion(std::string_view key, int size);
  std::array<bool, 3> booleans(std::string_view key, int size);
  std::vector<int> integers(std::string_view key);
  std::vector<double> numbers(std::string_view key, const Range& range);
  std::vector<std::string> texts(std::string_view key);
  /// Index of the choice among `names`; names.size() when the key is missing (no error) or wrong.
  std::size_t choose(std::string_view key, std::span<const std::string_view> names);
  template <class E, std::size_t N>
  E choice(std::string_view key, const Named<E> (&names)[N], std::optional<std::type_identity_t<E>> fallback);

  /// A table inside this one; absent when the key is not there.
  Table table(std::string_view key);
  /// The tables of an array of tables; none when the key is not there.
  std::vector<Table> tables(std::string_view key);

  /// Errors of the whole file so far: what was read since is right if the number has not changed.
  std::size_t error_count() const { return errors_->count(); }
  /// Reports an error at the key's value, or at this table when the key is not there.
  void error(std::string_view key, std::string_view text);
  void missing(std::string_view key, std::string_view text = "is missing; it has no default");
  void finish();

  Location where(std::string_view key = {}) const;
  const std::string& path() const { return path_; }
  std::string path_of(std::string_view key) const;

 private:
  const toml::array* list(std::string_view key, std::string_view what);
  Formula as_formula(const toml::node& node, std::string_view key);
  MotionTable as_rows(const toml::array& array, std::string_view key, int size);
  std::optional<double> as_number(const toml::node& node, std::string_view key, const Range& range);
  Vec3 as_vector(const toml::node& node, std::string_view key, int size, const Range& range);

  const toml::table* table_;
  std::string path_;
  Location where_;
  Errors* errors_;
  bool muted_ = false;  // not a table at all: one error has been reported, missing keys are no news
  std::vector<std::string> known_;
};

template <class E, std::size_t N>
E Table::choice(std::string_view key, const Named<E> (&names)[N], std::optional<std::type_identity_t<E>> fallback) {
  std::vector<std::string_view> list;
  for (const auto& entry : names) list.push_back(entry.name);
  if (!has(key) && !fallback) missing(key, "is missing; choose one of " + listed(list));
  const std::size_t i = choose(key, list);
  return i < N ? names[i].value : fallback.value_or(names[0].value);
}

template <class E, std::size_t N>
std::string_view name_of(const Named<E> (&names)[N], E value) {
  for (const auto& entry : names)
    if (entry.value == value) return entry.name;
  return names[0].name;
}

/// Reads a whole file of up to 4 GiB. \throws InputError where it cannot be read.
std::string read_bytes(const std::filesystem::path& file, std::string_view what);

/// Reads a whole text file. \throws InputError when it is not a readable text file.
std::string read_text(const std::filesystem::path& file, std::string_view what);

/// The text without a byte order mark of UTF-8 at its start, as spreadsheets write it.
std::string_view without_mark(std::string_view text);

/// Parses TOML; `name` says in messages where it is from. \throws InputError with name and line.
toml::table parse_text(std::string_view text, const std::string& name);

/// Parses a TOML file. \throws InputError with file and line.
toml::table parse_file(const std::filesystem::path& file, std::string_view what);

/// Puts the values of `--set` into the parsed file; errors are collected.
void apply_overrides(toml::table& root, const std::vector<Override>& overrides, Errors& errors);

}  // namespace cairn::reading
