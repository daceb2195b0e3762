#pragma once
/// Time histories as CSV, written by rank 0: a header line, then one line for each row. Numbers are the shortest
/// text that reads back to the same bits.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "cairn/io/checksum.hpp"

namespace cairn {

/// One entry of a row: a number, or a word without commas.
using CsvValue = std::variant<double, std::int64_t, std::string>;

/// How far a file has been written, and the checksum of all of it (checksum.hpp).
struct CsvPosition {
  std::int64_t bytes = 0;
  std::uint64_t checksum = 0;
};

/// What keeps the file from being continued at `from`: it is missing, shorter, or holds something else up to there.
/// Empty if nothing does. Not collective.
std::string check_prefix(const std::filesystem::path& file, const std::vector<std::string>& columns,
                         const CsvPosition& from);

/// Creates the file with its header at once and appends whole lines, each with one write to the system, so that
/// neither the program nor its end leaves part of a line. A default-constructed writer (ranks other than 0) does
/// nothing.
///
/// Nothing here throws for the system's errors, because the other ranks would wait for rank 0: the first error is kept,
/// later rows are dropped, and the caller reports it at its next meeting of all ranks:
///     throw_together(comm, history.error());   // agreement.hpp
class CsvWriter {
 public:
  CsvWriter() = default;
  /// Replaces a `file` of an earlier run; one that begins otherwise is an error.
  CsvWriter(std::filesystem::path file, std::vector<std::string> columns);
  /// Goes on with `file` at `from`: what lies behind is cut off.
  CsvWriter(std::filesystem::path file, std::vector<std::string> columns, const CsvPosition& from);
  /// Leaves all rows on the disk.
  ~CsvWriter();
  CsvWriter(CsvWriter&& other) noexcept;
  CsvWriter& operator=(CsvWriter&& other) noexcept;

  /// Appends one row. \throws std::logic_error if it does not have one value for each column.
  void add_row(std::span<const CsvValue> values);

  CsvPosition position() const { return {bytes_, sum_.value()}; }
  /// Has all rows so far flushed to disk.
  void flush();

  /// What went wrong, with the system's message; empty if nothing did.
  const std::string& error() const { return error_; }
  bool ok() const { return error_.empty(); }

 private:
  void append(const std::string& line);

  std::filesystem::path file_;
  std::size_t columns_ = 0;
  int descriptor_ = -1;
  std::int64_t bytes_ = 0;
  Checksum sum_;
  std::string error_;
};

}  // namespace cairn
