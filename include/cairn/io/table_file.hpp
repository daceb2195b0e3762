#pragma once
/// HDF5 files of distributed tables: every column is one dataset whose rows lie in patch order, whatever the rank
/// count.
///
/// Every table file has, at its root, one entry for each column and the attributes `kind`, `rows`, `time` [s] and
/// `step`, so that all are read alike. In a VTKHDF file the entries of the root are links into the group VTKHDF.
///
/// Writing: the file grows under the name `.NAME.part` in the same folder and is then renamed, so that a file with the
/// final name is always whole; where writing fails, nothing is left behind. It may still be in the system's memory:
/// flush_to_disk (result_files.hpp).

#include <mpi.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace cairn {

/// Which rows of the file this rank holds: its rows in memory, one block after the other, go to these file rows.
struct RowBlocks {
  struct Block {
    std::int64_t file_row, count;
  };
  std::vector<Block> blocks;    // ascending in file_row
  std::int64_t total_rows = 0;  // over all ranks
  std::int64_t local_rows() const {
    std::int64_t n = 0;
    for (const auto& b : blocks) n += b.count;
    return n;
  }
};

/// Values made when they are written: those of the rows of one of RowBlocks::blocks, by its place there. They have to
/// stay until the next call only, so that a large column never lies in memory as a whole.
template <class T>
using BlockSource = std::function<std::span<const T>(std::size_t block)>;

/// One named column: local_rows x components values, row by row.
struct Column {
  std::string name;
  int components = 1;
  std::variant<std::span<const double>, std::span<const std::int32_t>, std::span<const std::int64_t>,
               BlockSource<double>, BlockSource<std::int32_t>, BlockSource<std::int64_t>>
      values;
};

/// Triangles over the rows of a table: this rank's rows of them, and the rows of their corners, three for each.
struct TriangleCells {
  RowBlocks rows;
  std::span<const std::int64_t> corners;
};

/// Writes point data as a VTKHDF 1.0 unstructured grid of vertices, or of the triangles that are given, that ParaView
/// opens as it is. The file is written
/// under a temporary name and renamed when whole. Collective.
/// `columns` must hold "position" (components 3, double); it becomes the grid's points and is not repeated as point
/// data. `kind` says in words what the rows are. \throws RunError with the system's message when writing fails (on
/// every rank).
void write_vtkhdf(const std::filesystem::path& file, MPI_Comm comm, const RowBlocks& rows,
                  std::span<const Column> columns, double time, std::int64_t step,
                  const std::string& kind = "material points", const TriangleCells* triangles = nullptr);

/// Writes a plain table: one dataset at the root for each column. Otherwise as write_vtkhdf. Collective.
/// \throws RunError with the system's message when writing fails (on every rank).
void write_table(const std::filesystem::path& file, MPI_Comm comm, const RowBlocks& rows,
                 std::span<const Column> columns, double time, std::int64_t step, const std::string& kind);

/// Reads the columns of a table file back, each rank the rows it asks for, on any number of ranks.
class TableReader {
 public:
  /// Opens the file. Collective. \throws InputError (on every rank) if it is missing or no whole table file.
  TableReader(const std::filesystem::path& file, MPI_Comm comm);
  ~TableReader();
  TableReader(const TableReader&) = delete;
  TableReader& operator=(const TableReader&) = delete;

  std::int64_t rows() const;
  double time() const;  // [s]
  std::int64_t step() const;
  const std::string& kind() const;
  /// Rows of one column, where columns differ in that; -1 if there is no such column.
  std::int64_t rows_of(const std::string& column) const;
  /// A number at the root; false if there is none of this name.
  bool attribute(const std::string& name, double& value) const;
  bool attribute(const std::string& name, std::int64_t& value) const;

  /// Fills `values` (local_rows x components) with this rank's rows of a column of rows.total_rows; ranks may ask for
  /// the same rows. Collective.
  /// \throws InputError (on every rank) if there is no such column of that shape, RunError if reading fails.
  void read(const std::string& column, int components, const RowBlocks& rows, std::span<double> values) const;
  void read(const std::string& column, int components, const RowBlocks& rows, std::span<std::int32_t> values) const;
  void read(const std::string& column, int components, const RowBlocks& rows, std::span<std::int64_t> values) const;
  void read(const std::string& column, int components, const RowBlocks& rows, std::span<std::uint8_t> values) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The index of a time series, which ParaView opens as one data set with its times: JSON, rewritten whole with every
/// file that is added and renamed into place. Its name should end in ".hdf.series": ParaView 5.11 knows
/// that ending and not ".vtkhdf.series"; later versions know both.
class SeriesIndex {
 public:
  explicit SeriesIndex(std::filesystem::path file) : file_(std::move(file)) {}

  /// Adds one data file (`name` relative to the index) and writes the index from rank 0. Collective.
  /// \throws RunError (on every rank) if that fails.
  void add(const std::string& name, double time, MPI_Comm comm);

  struct Entry {
    std::string name;
    double time;  // [s]
  };
  const std::vector<Entry>& entries() const { return entries_; }
  /// Goes on from these entries, and writes the index if there are any. Collective; throws as add().
  void restore(std::vector<Entry> entries, MPI_Comm comm);

 private:
  void write(MPI_Comm comm) const;

  std::filesystem::path file_;
  std::vector<Entry> entries_;
};

}  // namespace cairn
