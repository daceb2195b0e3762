#pragma once
/// Checkpoint files: HDF5 with columns of several lengths, numbers at the root and texts, and a seal (length and
/// checksum of the whole file) at the end. What lies in them: solver/checkpoint.hpp.
///
/// As with other tables the file grows under a temporary name and is renamed once it is whole and on disk.

#include "cairn/io/table_file.hpp"

namespace cairn {

/// Every member is collective and throws the same RunError on every rank if it fails on any. Destroyed before finish(),
/// the writer leaves no file.
class CheckpointWriter {
 public:
  /// `bytes`: of all columns together, at least; `rows`: material points.
  CheckpointWriter(std::filesystem::path file, MPI_Comm comm, std::int64_t bytes, std::int64_t rows, double time,
                   std::int64_t step);
  ~CheckpointWriter();
  CheckpointWriter(const CheckpointWriter&) = delete;
  CheckpointWriter& operator=(const CheckpointWriter&) = delete;

  void add(const std::string& name, double value);
  void add(const std::string& name, std::int64_t value);
  /// A text of any length, as rank 0 has it.
  void add_text(const std::string& name, const std::string& text);
  void write(const Column& column, const RowBlocks& rows);
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Opens a checkpoint whose seal is unbroken. Members are collective and throw InputError naming the file on every
/// rank.
class CheckpointReader {
 public:
  /// \throws InputError if the file is missing, cut short, damaged, or no checkpoint of this version
  CheckpointReader(const std::filesystem::path& file, MPI_Comm comm);

  const std::filesystem::path& file() const { return file_; }
  const TableReader& table() const { return *table_; }
  /// Rows of a column. \throws InputError if there is no such column
  std::int64_t rows_of(const std::string& column) const;
  void read(const std::string& name, double& value) const;
  void read(const std::string& name, std::int64_t& value) const;
  /// A text, on every rank.
  std::string text(const std::string& name) const;
  /// A whole column, on every rank.
  template <class T>
  std::vector<T> column(const std::string& name, int components = 1) const {
    const std::int64_t count = rows_of(name);
    std::vector<T> values(static_cast<std::size_t>(count * components));
    table_->read(name, components, {{{0, count}}, count}, std::span<T>(values));
    return values;
  }
  /// \throws InputError "FILE: problem" if the problem is not empty on any rank
  void require(const std::string& problem) const;

 private:
  std::filesystem::path file_;
  MPI_Comm comm_;
  std::unique_ptr<TableReader> table_;
};

}  // namespace cairn
