#pragma once
/// Words of a text file, line by line.

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "cairn/core/error.hpp"
#include "case_reader.hpp"

namespace cairn::reading {

class TextScanner {
 public:
  explicit TextScanner(std::string_view text) : rest_(without_mark(text)) {}

  /// Goes to the next line; false at the end.
  bool next_line() {
    if (rest_.empty()) return false;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line_ = rest_.substr(0, end);
    if (line_.ends_with('\r')) line_.remove_suffix(1);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++number_;
    return true;
  }
  void skip_line() { line_ = {}; }
  /// The next word of the line; empty at its end.
  std::string_view word() {
    const std::size_t first = std::min(line_.find_first_not_of(" \t\v\f"), line_.size());
    line_.remove_prefix(first);
    const std::string_view found = line_.substr(0, line_.find_first_of(" \t\v\f"));
    line_.remove_prefix(found.size());
    return found;
  }
  /// What is left of the line, without blanks around it.
  std::string_view rest_of_line() const {
    const std::size_t first = line_.find_first_not_of(" \t");
    return first == line_.npos ? std::string_view{} : line_.substr(first, line_.find_last_not_of(" \t") - first + 1);
  }
  double number(std::string_view what) {
    const std::string_view text = word();
    return number_of(text, what);
  }
  double number_of(std::string_view text, std::string_view what) const {
    std::string_view digits = text;
    if (digits.starts_with('+')) digits.remove_prefix(1);
    double value = 0;
    const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (digits.empty() || end != digits.data() + digits.size() || status != std::errc{} || !std::isfinite(value))
      fail(text.empty() ? fmt::format("{} is missing", what)
                        : fmt::format("{}: {} is not a finite number", what, in_quotes(text)));
    return value;
  }
  std::int64_t line() const { return number_; }
  [[noreturn]] void fail(std::string_view text) const { throw InputError(fmt::format(":{}: {}", number_, text)); }

 private:
  std::string_view rest_, line_;
  std::int64_t number_ = 0;
};

}  // namespace cairn::reading
