// From files and `--set` to one TOML tree whose nodes know where they were written.

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>

#include "cairn/core/error.hpp"
#include "case_reader.hpp"

namespace cairn::reading {
namespace {

constexpr std::uintmax_t largest_file = std::uintmax_t{1} << 32;

/// `text` without what a terminal would act on.
std::string printable(std::string_view text) {
  std::string result;
  for (const char c : text.substr(0, 300)) result += static_cast<unsigned char>(c) < 32 || c == 127 ? '?' : c;
  return result;
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
               fmt::format("'{}' is inside a plain value; only tables and arrays have parts", printable(part)));
    return nullptr;
  }
  std::size_t index = 0;
  const auto [end, status] = std::from_chars(part.data(), part.data() + part.size(), index);
  if (status == std::errc{} && end == part.data() + part.size() && index < array->size()) return array->get(index);
  errors.add(where, "",
             fmt::format("'{}' is not an entry of the array; it has {} entries, counted from 0", printable(part),
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
  try {
    return toml::parse("value = " + text, source);
  } catch (const toml::parse_error&) {
    return is_word(text) ? toml::parse(fmt::format("value = \"{}\"", text), source) : toml::table{};
  }
}

void apply(toml::table& root, const Override& change, Errors& errors) {
  const Location where{"--set " + printable(change.key), 0};
  const auto parts = split_key(change.key);
  for (const auto& part : parts)
    if (part.empty()) return errors.add(where, "", "not a key; write --set table.key=VALUE");
  toml::table parsed = parse_value(change.value, where.file);
  if (parsed.size() != 1 || !parsed.get("value"))
    return errors.add(where, "",
                      fmt::format("{} is not a TOML value; strings need quotes: --set '{}=\"text\"'",
                                  in_quotes(change.value), printable(change.key)));
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

std::string read_text(const std::filesystem::path& file, std::string_view what) {
  const auto fail = [&](std::string_view text) {
    throw InputError(fmt::format("{}: {}", printable(file.string()), text));
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
  std::string content = std::move(text).str();
  if (content.find('\0') != std::string::npos) fail(fmt::format("is not a text file; {} is needed", what));
  return content;
}

toml::table parse_file(const std::filesystem::path& file, std::string_view what) {
  const std::string content = read_text(file, what);
  if (content.find_first_not_of(" \t\r\n") == std::string::npos)
    throw InputError(fmt::format("{}:1: the file is empty; {} is needed", file.string(), what));
  try {
    return toml::parse(content, file.string());
  } catch (const toml::parse_error& error) {
    throw InputError(fmt::format("{}:{}: not valid TOML: {}", file.string(), error.source().begin.line,
                                 printable(error.description())));
  }
}

void apply_overrides(toml::table& root, const std::vector<Override>& overrides, Errors& errors) {
  for (const auto& change : overrides) apply(root, change, errors);
}

}  // namespace cairn::reading
