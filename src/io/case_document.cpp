// From files and `--set` to one TOML tree whose nodes know where they were written.

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>

#include "cairn/core/error.hpp"
#include "cairn/core/printable.hpp"
#include "case_reader.hpp"

namespace cairn::reading {
namespace {

constexpr std::uintmax_t largest_file = std::uintmax_t{1} << 32;

constexpr std::size_t longest_text = 300;  // of a file in a message

std::string shortened(std::string_view text) { return printable(text.substr(0, longest_text)); }

constexpr int most_key_parts = 32;

/// The line that has a key of more parts than any table is deep; 0 where there is none. The parser takes a key apart
/// into tables within tables, of which thousands would not fit on the stack. Counted are the dots outside of strings
/// and comments between what may end a key.
std::int64_t line_of_long_key(std::string_view text) {
  std::int64_t line = 1;
  int dots = 0;
  std::string_view quote;  // that ends the string; empty outside of strings
  const auto at_quote = [&](std::size_t i) {
    for (const char* mark : {"\"\"\"", "'''", "\"", "'"})
      if (text.substr(i).starts_with(mark)) return std::string_view(mark);
    return std::string_view();
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') ++line;
    if (!quote.empty()) {
      const bool one_line = quote.size() == 1;
      if (c == '\\' && quote[0] == '"') {
        if (++i < text.size() && text[i] == '\n') ++line;
      } else if (text.substr(i).starts_with(quote) || (one_line && c == '\n')) {
        i += c == '\n' ? 0 : quote.size() - 1;
        quote = {};
      }
    } else if (c == '#') {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (quote = at_quote(i); !quote.empty()) {
      i += quote.size() - 1;
    } else if (c == '.') {
      if (++dots >= most_key_parts) return line;
    } else if (std::string_view("=,{}[]\n").find(c) != std::string_view::npos) {
      dots = 0;
    }
  }
  return 0;
}

std::vector<std::string> split_key(std::string_view key) {
  std::vector<std::string> parts;
  std::stringstream stream{std::string(key) + "."};
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  return parts;
}

/// The node that `part` names inside `node`; a table that is not there yet is made. Null after an error.
toml::node* descend(toml::node& node, const std::string& part, const Location& where, Errors& errors) {
  if (toml::table* table = node.as_table()) {
    if (!table->get(part)) table->insert(part, toml::table{});
    return table->get(part);
  }
  toml::array* array = node.as_array();
  if (!array) {
    errors.add(where, "",
               fmt::format("'{}' is inside a plain value; only tables and arrays have parts", shortened(part)));
    return nullptr;
  }
  std::size_t index = 0;
  const auto [end, status] = std::from_chars(part.data(), part.data() + part.size(), index);
  if (status == std::errc{} && end == part.data() + part.size() && index < array->size()) return array->get(index);
  errors.add(where, "",
             fmt::format("'{}' is not an entry of the array; it has {} entries, counted from 0", shortened(part),
                         array->size()));
  return nullptr;
}

/// True for a name or a path, which a value on the command line may be without quotes: letters, digits and _ - . / with
/// a letter before any digit, so that no number that was written wrongly is taken for one.
bool is_word(std::string_view text) {
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ", marks = "_-./";
  const std::string known = fmt::format("{}{}0123456789", letters, marks);
  const std::size_t first = text.find_first_not_of(marks);
  return text.find_first_not_of(known) == text.npos && first != text.npos && letters.find(text[first]) != text.npos;
}

/// A table of one `value`; an empty one where the text is no value.
toml::table parse_value(const std::string& text, const std::string& source) {
  if (line_of_long_key(text) > 0) return {};
  try {
    return toml::parse("value = " + text, source);
  } catch (const toml::parse_error&) {
    return is_word(text) ? toml::parse(fmt::format("value = \"{}\"", text), source) : toml::table{};
  }
}

void apply(toml::table& root, const Override& change, Errors& errors) {
  const Location where{"--set " + shortened(change.key), 0};
  const auto parts = split_key(change.key);
  for (const auto& part : parts)
    if (part.empty()) return errors.add(where, "", "not a key; write --set table.key=VALUE");
  if (parts.size() > most_key_parts)
    return errors.add(where, "", fmt::format("a key of {} parts; no table is that deep", parts.size()));
  toml::table parsed = parse_value(change.value, where.file);
  if (parsed.size() != 1 || !parsed.get("value"))
    return errors.add(where, "",
                      fmt::format("{} is not a TOML value; strings need quotes: --set '{}=\"text\"'",
                                  in_quotes(change.value), shortened(change.key)));
  toml::node* node = &root;
  for (std::size_t i = 0; i + 1 < parts.size() && node; ++i) node = descend(*node, parts[i], where, errors);
  if (!node) return;
  // The position of a node survives a move but not a copy.
  parsed.get("value")->visit([&](auto& value) {
    if (toml::table* table = node->as_table()) {
      table->insert_or_assign(parts.back(), std::move(value));
    } else if (toml::node* entry = descend(*node, parts.back(), where, errors)) {
      toml::array& array = *node->as_array();
      for (auto it = array.begin(); it != array.end(); ++it)
        if (&*it == entry) {
          array.replace(it, std::move(value));
          break;
        }
    }
  });
}

}  // namespace

std::string read_bytes(const std::filesystem::path& file, std::string_view what) {
  const auto fail = [&](std::string_view text) {
    throw InputError(fmt::format("{}: {}", shortened(file.string()), text));
  };
  std::error_code status;
  if (!std::filesystem::exists(file, status)) fail(fmt::format("there is no such file; {} is needed", what));
  if (std::filesystem::is_directory(file, status)) fail(fmt::format("is a folder; {} is needed", what));
  if (!std::filesystem::is_regular_file(file, status)) fail(fmt::format("is not a regular file; {} is needed", what));
  if (std::filesystem::file_size(file, status) > largest_file)
    fail(fmt::format("is larger than 4 GiB; {} is needed", what));
  std::ifstream stream(file, std::ios::binary);
  if (!stream) fail(fmt::format("cannot be read ({}); check its permissions", std::strerror(errno)));
  std::ostringstream text;
  text << stream.rdbuf();
  if (stream.bad()) fail("cannot be read to its end");
  return std::move(text).str();
}

std::string read_text(const std::filesystem::path& file, std::string_view what) {
  const auto fail = [&](std::string_view text) {
    throw InputError(fmt::format("{}: {}", shortened(file.string()), text));
  };
  std::string content = read_bytes(file, what);
  if (content.starts_with("\xFF\xFE") || content.starts_with("\xFE\xFF"))
    fail(fmt::format("is text in UTF-16, as its first two bytes say; save it as UTF-8; {} is needed", what));
  if (content.find('\0') != std::string::npos) fail(fmt::format("is not a text file; {} is needed", what));
  return content;
}

std::string_view without_mark(std::string_view text) {
  constexpr std::string_view mark = "\xEF\xBB\xBF";
  return text.substr(text.starts_with(mark) ? mark.size() : 0);
}

toml::table parse_text(std::string_view text, const std::string& name) {
  if (const std::int64_t line = line_of_long_key(text); line > 0)
    throw InputError(fmt::format("{}:{}: not valid TOML: a key of more than {} parts", name, line, most_key_parts));
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    throw InputError(
        fmt::format("{}:{}: not valid TOML: {}", name, error.source().begin.line, shortened(error.description())));
  }
}

toml::table parse_file(const std::filesystem::path& file, std::string_view what) {
  const std::string text = read_text(file, what);
  const std::string_view content = without_mark(text);
  if (content.find_first_not_of(" \t\r\n") == std::string::npos)
    throw InputError(fmt::format("{}:1: the file is empty; {} is needed", file.string(), what));
  return parse_text(content, file.string());
}

void apply_overrides(toml::table& root, const std::vector<Override>& overrides, Errors& errors) {
  for (const auto& change : overrides) apply(root, change, errors);
}

}  // namespace cairn::reading
