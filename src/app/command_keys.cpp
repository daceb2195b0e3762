/// The keys of the case file as docs/case-file.md explains them: its tables are read, so that the two cannot differ.

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "cairn/core/error.hpp"
#include "cairn/core/printable.hpp"
#include "commands.hpp"
#include "pages.hpp"
#include "report.hpp"

namespace cairn::app {
namespace {

/// A row of a table: what it is about, and the other columns as text.
struct Entry {
  std::string key, text;
};

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(' ') - first + 1));
}

/// The text without the marks of code.
std::string plain(std::string text) {
  std::erase(text, '`');
  return text;
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells;
  line.remove_prefix(1);
  for (std::size_t end; (end = line.find('|')) != std::string_view::npos; line.remove_prefix(end + 1))
    cells.push_back(trimmed(line.substr(0, end)));
  return cells;
}

/// "## [domain]" to "domain.", "## [[bodies]]" to "bodies.N."; empty for a heading that names no section.
std::string section_of(std::string_view heading) {
  const auto begin = heading.find('['), end = heading.find(']');
  if (begin == std::string_view::npos) return {};
  const bool array = heading.substr(begin).starts_with("[[");
  const auto at = begin + (array ? 2 : 1);
  return std::string(heading.substr(at, end - at)) + (array ? ".N." : ".");
}

/// What is between the section and the names in the first column.
std::string prefix_of(const std::string& first_column, const std::string& section) {
  constexpr std::string_view owner = "Key of ";
  if (first_column == "Key of a face") return section + "FACE.";
  if (first_column.starts_with(owner)) return section + first_column.substr(owner.size()) + ".";
  if (first_column == "Condition") return section + "KIND.";
  if (first_column == "Shape type") return section + "shape.type = ";
  if (first_column == "model") return section + "model = ";
  return section;
}

Entry entry_of(const std::vector<std::string>& head, const std::vector<std::string>& row, const std::string& section) {
  const std::string prefix = prefix_of(plain(head[0]), section);
  Entry entry;
  for (std::string_view rest = row[0]; rest.find('`') != std::string_view::npos;) {
    rest.remove_prefix(rest.find('`') + 1);
    const auto end = rest.find('`');
    entry.key += fmt::format("{}{}{}", entry.key.empty() ? "" : ", ", prefix, rest.substr(0, end));
    rest.remove_prefix(end + 1);
  }
  for (std::size_t i = 1; i < std::min(row.size(), head.size()); ++i)
    if (!row[i].empty())
      entry.text +=
          i == 1 ? fmt::format("  {}\n", plain(row[i])) : fmt::format("  {}: {}\n", lower(head[i]), plain(row[i]));
  return entry;
}

std::vector<Entry> read_entries(std::string_view page) {
  std::vector<Entry> entries;
  std::vector<std::string> head;
  std::string section;
  for (std::size_t end; !page.empty(); page.remove_prefix(std::min(end, page.size() - 1) + 1)) {
    end = std::min(page.find('\n'), page.size());
    const std::string_view line = page.substr(0, end);
    if (line.starts_with('#')) section = section_of(line);
    if (!line.starts_with('|'))
      head.clear();
    else if (head.empty())
      head = cells_of(line);
    else if (line.starts_with("| "))
      entries.push_back(entry_of(head, cells_of(line), section));
  }
  return entries;
}

}  // namespace

int command_keys(const std::string& pattern) {
  return on_first_rank([&] {
    const std::string wanted = lower(pattern);
    std::string found;
    const auto entries = read_entries(case_file_page);
    // Where a key has the word in its name, those where it merely is in the explanation are left out.
    const auto named = [&](const Entry& e) { return lower(e.key).find(wanted) != std::string::npos; };
    const bool by_name = std::ranges::any_of(entries, named);
    for (const Entry& e : entries)
      if (by_name ? named(e) : lower(e.text).find(wanted) != std::string::npos)
        found += fmt::format("{}\n{}", e.key, pattern.empty() ? "" : e.text);
    if (found.empty())
      throw InputError(fmt::format("no key and no explanation of one holds '{}'; cairn keys lists all", pattern));
    std::fputs(found.c_str(), stdout);
    std::fflush(stdout);
  });
}

}  // namespace cairn::app
