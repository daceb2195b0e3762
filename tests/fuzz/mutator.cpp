#include "mutator.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace cairn::fuzz {
namespace {

constexpr const char* odd_numbers[] = {"0",
                                       "-0.0",
                                       "-1",
                                       "1",
                                       "2",
                                       "3",
                                       "1e-320",
                                       "1e-300",
                                       "1e-30",
                                       "1e-9",
                                       "1e9",
                                       "1e30",
                                       "1e300",
                                       "1.8e308",
                                       "-1e300",
                                       "1e999",
                                       "inf",
                                       "-inf",
                                       "nan",
                                       "+nan",
                                       "2147483647",
                                       "2147483648",
                                       "4294967296",
                                       "9223372036854775807",
                                       "9223372036854775808",
                                       "-9223372036854775808",
                                       "0x7fffffff",
                                       "1_000_000",
                                       "0.1e",
                                       "00012",
                                       "1e-7",
                                       "0.49999999999999994"};

constexpr const char* odd_bytes[] = {"\"",   "'",        "[",
                                     "]",    "{",        "}",
                                     "[[",   "]]",       "=",
                                     ",",    ".",        "#",
                                     "\n",   "\r\n",     "\t",
                                     "\\",   "\\u0000",  "\"\"\"",
                                     "\xff", "\xc3\xa9", "\xf0\x9f\x8c\x8d",
                                     "\x7f", "=[",       "1979-05-27T07:32:00Z",
                                     "true", "false",    "{}",
                                     "[]",   "../",      "/",
                                     "%s%n", " "};

}  // namespace

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  for (std::size_t at = text.find_first_of(letters); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_not_of(letters, at), text.size());
    words.emplace_back(text.substr(at, end - at));
    at = text.find_first_of(letters, end);
  }
  return words;
}

std::string Mutator::number() {
  if (one_in(2)) return odd_numbers[below(std::size(odd_numbers))];
  const double value = (one_in(4) ? -1.0 : 1.0) * static_cast<double>(below(100000)) * 1e-3;
  return one_in(3) ? fmt::format("{}", static_cast<int>(value)) : fmt::format("{}", value);
}

std::string Mutator::mutate(std::string text) {
  for (std::size_t changes = 1 + below(1 + below(4)); changes > 0; --changes) change(text);
  return text;
}

Mutator::Span Mutator::any_span(const std::string& text, std::size_t most) {
  const std::size_t begin = below(text.size() + 1);
  return {begin, std::min(text.size() - begin, below(most))};
}

void Mutator::change(std::string& text) {
  switch (below(12)) {
    case 0:
      return change_bytes(text);
    case 1:
    case 2:
      return change_lines(text);
    case 3:
    case 4:
      return replace_token(text, letters, any(words_));
    case 5:
      text.insert(below(text.size() + 1), odd_bytes[below(std::size(odd_bytes))]);
      return;
    default:
      return replace_token(text, digits, number());
  }
}

void Mutator::change_bytes(std::string& text) {
  const Span span = any_span(text, 40);
  switch (below(5)) {
    case 0:
      if (!text.empty()) text[below(text.size())] ^= static_cast<char>(1u << below(8));
      return;
    case 1:
      text.erase(span.begin, span.size);
      return;
    case 2:
      text.insert(below(text.size() + 1), std::string(text, span.begin, span.size));
      return;
    case 3:
      text.resize(span.begin);  // cut short
      return;
    default:
      text.insert(span.begin, 1 + below(200), odd_bytes[below(std::size(odd_bytes))][0]);
  }
}

void Mutator::change_lines(std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size() - 1);
    lines.push_back(text.substr(at, end - at + 1));
    at = end + 1;
  }
  if (lines.empty()) return;
  const std::size_t a = below(lines.size()), b = below(lines.size());
  switch (below(4)) {
    case 0:
      lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(a));
      break;
    case 1:
      lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(a), std::string(lines[b]));
      break;
    case 2:
      std::swap(lines[a], lines[b]);
      break;
    default: {
      const std::string& other = any(texts_);
      const Span span = any_span(other, 200);
      lines[a] += other.substr(span.begin, span.size);
    }
  }
  text.clear();
  for (const auto& line : lines) text += line;
}

/// Replaces a run of `letters` near a random place.
void Mutator::replace_token(std::string& text, std::string_view letters, const std::string& with) {
  const std::size_t from = text.find_first_of(letters, below(text.size() + 1));
  if (from == std::string::npos) return;
  const std::size_t before = text.find_last_not_of(letters, from);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  const std::size_t end = std::min(text.find_first_not_of(letters, from), text.size());
  text.replace(begin, end - begin, with);
}

}  // namespace cairn::fuzz
