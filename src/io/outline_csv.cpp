// Lines as tables of points.

#include <fmt/format.h>

#include <algorithm>

#include "shape_files.hpp"
#include "text_scanner.hpp"

namespace cairn::reading {
namespace {

std::vector<std::string_view> cells_of(std::string_view line) {
  const std::string_view separators = line.find(';') != line.npos ? ";" : line.find(',') != line.npos ? "," : " \t";
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find_first_of(separators, begin), line.size());
    std::string_view cell = line.substr(begin, end - begin);
    while (cell.starts_with(' ') || cell.starts_with('\t')) cell.remove_prefix(1);
    while (cell.ends_with(' ') || cell.ends_with('\t')) cell.remove_suffix(1);
    if (!cell.empty() || separators.size() == 1) cells.push_back(cell);
    begin = end + 1;
  }
  return cells;
}

}  // namespace

/// An empty line, or another value in the column `line`, begins a new line.
std::vector<LinePart> read_csv_lines(std::string_view bytes) {
  TextScanner scanner(bytes);
  std::vector<LinePart> lines;
  std::size_t x = 0, y = 1, which = std::string_view::npos, width = 0;
  std::string last;
  bool fresh = true;
  while (scanner.next_line()) {
    const std::string_view text = scanner.rest_of_line();
    if (text.empty()) fresh = true;
    if (text.empty() || text.starts_with('#')) continue;
    const auto cells = cells_of(text);
    const auto column = [&](std::string_view name) {
      const auto found = std::ranges::find(cells, name);
      return found == cells.end() ? std::string_view::npos : static_cast<std::size_t>(found - cells.begin());
    };
    if (width == 0) {
      width = cells.size();
      if (column("x") != std::string_view::npos || column("y") != std::string_view::npos) {
        x = column("x"), y = column("y"), which = column("line");
        if (std::max(x, y) == std::string_view::npos) scanner.fail("the first line names no columns x and y");
        continue;
      }
      if (width != 2)
        scanner.fail(fmt::format("has {} values; the first line must name the columns x, y[, line]", width));
    }
    if (cells.size() != width) scanner.fail(fmt::format("has {} values; {} are expected", cells.size(), width));
    if (which != std::string_view::npos && cells[which] != last) fresh = true, last = cells[which];
    if (std::exchange(fresh, false)) lines.push_back({last, {}});
    lines.back().points.emplace_back(scanner.number_of(cells[x], "x"), scanner.number_of(cells[y], "y"), 0.0);
  }
  return lines;
}

std::vector<LinePart> read_lines(std::string_view bytes) {
  const std::string_view text = without_mark(bytes);
  const std::size_t first = std::min(text.find_first_not_of(" \t\r\n"), text.size());
  const std::string_view head = text.substr(first, 2000);
  if (text.find('\0') != text.npos)
    throw InputError(": is no text; an outline is CSV, SVG or DXF (not its binary form)");
  if (head.starts_with('<')) return read_svg_lines(text);
  const std::string_view code = head.substr(0, head.find_first_of("\r\n"));
  if ((code == "0" || code == "999") && text.find("SECTION") != text.npos) return read_dxf_lines(text);
  return read_csv_lines(text);
}

}  // namespace cairn::reading
