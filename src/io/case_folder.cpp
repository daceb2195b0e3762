#include "cairn/io/case_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "cairn/core/printable.hpp"
#include "cairn/io/checksum.hpp"
#include "cairn/io/own_files.hpp"
#include "cairn/io/result_files.hpp"
#include "table_writer.hpp"

namespace cairn {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF"sv;

std::string text_of(const Case& c) { return std::string(case_mark) + c.resolved; }

/// The case file lies under the name of its copy and already is what would be written.
bool is_own_copy(const Case& c, const fs::path& target) {
  if (!same_file(c.file, target)) return false;
  const std::string text = text_of(c);
  const PosixFile open(target, O_RDONLY);
  std::string there(text.size(), '\0');
  return open.size() == std::ssize(text) && open.read(there.data(), std::ssize(there), 0) && there == text;
}

/// The first input of the case that is this file; empty if none is.
fs::path input_at(const Case& c, const fs::path& target) {
  if (same_file(c.file, target)) return c.file;
  for (const auto& table : c.tables)
    if (same_file(table.file, target)) return table.file;
  return {};
}

/// Copies a table behind a line that says so, or a file as it is, and sees to it that it is the table that was read.
std::string copy_table(const CaseTable& table, const fs::path& target) {
  const fs::path temporary = temporary_name(target);
  const PosixFile in(table.file, O_RDONLY);
  PosixFile out = create_temporary(temporary);
  if (!out.valid()) return write_failure(target, "creating the file", std::strerror(errno));
  const auto fail = [&](const std::string& text) {
    ::unlink(temporary.c_str());
    return text;
  };
  std::vector<char> buffer(std::size_t{1} << 20);
  Checksum sum;
  std::int64_t written = 0;
  for (std::int64_t at = 0, size = in.size(); at < size;) {
    const std::int64_t count = std::min(size - at, std::ssize(buffer));
    if (!in.read(buffer.data(), count, at)) return fail(fmt::format("cannot read {} again", table.file.string()));
    std::string_view bytes(buffer.data(), static_cast<std::size_t>(count));
    sum.add_values(std::span(bytes.data(), bytes.size()));
    std::string head;
    if (at == 0 && table.marked && bytes.starts_with(byte_order_mark)) bytes.remove_prefix(byte_order_mark.size());
    if (at == 0 && table.marked && !bytes.starts_with(table_mark))
      head = fmt::format("{}{}\n", table_mark, printable(table.file.filename().string()));
    if (!out.write(head.data(), std::ssize(head), written) ||
        !out.write(bytes.data(), std::ssize(bytes), written + std::ssize(head)))
      return fail(write_failure(target, "writing", std::strerror(errno)));
    written += std::ssize(head) + std::ssize(bytes);
    at += count;
  }
  if (sum.value() != table.checksum)
    return fail(fmt::format("{} was changed after it had been read; run again", table.file.string()));
  const std::string error =
      out.close() ? publish(temporary, target) : write_failure(target, "writing", std::strerror(errno));
  return error.empty() ? "" : fail(error);
}

}  // namespace

std::string check_targets(const Case& c, const fs::path& out) {
  const fs::path case_file = out / "case.toml";
  if (same_file(c.file, case_file) && !is_own_copy(c, case_file))
    return fmt::format(
        "{}: is the case of this run and would be replaced; choose another folder, or give the case another name",
        case_file.string());
  std::vector<fs::path> targets = {case_file};
  for (const auto& table : c.tables) targets.push_back(out / table.copy);
  std::error_code error;
  for (fs::directory_iterator entry(out, error); !error && entry != fs::directory_iterator(); entry.increment(error))
    if (is_result_name(entry->path().filename().string())) targets.push_back(entry->path());
  std::sort(targets.begin() + 1 + std::ssize(c.tables), targets.end());
  for (const auto& target : targets)
    if (std::string reason = foreign_result(target); !reason.empty()) return reason;
  for (const auto& table : c.tables) {
    const fs::path input = input_at(c, out / table.copy);
    if (!input.empty() && !same_file(input, table.file))
      return fmt::format("{}: is read by this case and would be replaced; choose another folder", input.string());
  }
  return {};
}

std::string write_case_files(const Case& c, const fs::path& out) {
  const fs::path case_file = out / "case.toml";
  std::string error = is_own_copy(c, case_file) ? "" : replace_file(case_file, text_of(c));
  for (const auto& table : c.tables)
    if (error.empty() && !same_file(table.file, out / table.copy)) error = copy_table(table, out / table.copy);
  return error;
}

}  // namespace cairn
