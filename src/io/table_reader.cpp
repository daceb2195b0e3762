#include <fmt/format.h>

#include <cerrno>

#include "cairn/core/error.hpp"
#include "cairn/io/agreement.hpp"
#include "cairn/io/table_file.hpp"
#include "table_writer.hpp"

namespace cairn {

using hdf5::Handle;

// Every rank opens the file by itself: nothing here communicates but the agreement on errors, so that a rank that is
// gone, or out of memory, leaves nobody waiting inside the library.

struct TableReader::State {
  std::filesystem::path file;
  MPI_Comm comm;
  Handle handle;
  std::int64_t rows = 0, step = 0;
  double time = 0;
  std::string kind;

  void require_input(const std::string& problem) const {
    const std::string message = common_error(comm, problem.empty() ? "" : file.string() + ": " + problem);
    if (!message.empty()) throw InputError(message);
  }

  template <class T>
  void read(const std::string& column, int components, const RowBlocks& rows_wanted, std::span<T> values) const;
};

namespace {

hsize_t size_of(std::int64_t n) { return static_cast<hsize_t>(n); }

/// Columns of one component are one-dimensional.
Handle make_space(std::int64_t rows, int components) {
  const hsize_t extent[2] = {size_of(rows), size_of(components)};
  return {H5Screate_simple(components == 1 ? 1 : 2, extent, nullptr), H5Sclose};
}

Handle select_blocks(std::span<const RowBlocks::Block> blocks, std::int64_t total_rows, int components) {
  constexpr std::size_t few = 32;
  if (blocks.size() > few) {
    const std::size_t half = blocks.size() / 2;
    const Handle lower = select_blocks(blocks.first(half), total_rows, components);
    const Handle upper = select_blocks(blocks.subspan(half), total_rows, components);
    if (!lower.valid() || !upper.valid()) return {};
    return {H5Scombine_select(lower, H5S_SELECT_OR, upper), H5Sclose};
  }
  Handle space = make_space(total_rows, components);
  if (!space.valid() || H5Sselect_none(space) < 0) return {};
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const hsize_t start[2] = {size_of(blocks[i].file_row), 0};
    const hsize_t count[2] = {size_of(blocks[i].count), size_of(components)};
    if (H5Sselect_hyperslab(space, i == 0 ? H5S_SELECT_SET : H5S_SELECT_OR, start, nullptr, count, nullptr) < 0)
      return {};
  }
  return space;
}

/// File rows of a rank as a selection of a dataset of `total_rows` x `components` values; empty handle on failure.
/// The selection is built by halves: adding the blocks one by one would take time quadratic in their number.
Handle select_rows(const RowBlocks& rows, int components) {
  return select_blocks(merged_blocks(rows), rows.total_rows, components);
}

/// Space of `rows` x `components` values in memory, all selected.
Handle memory_space(std::int64_t rows, int components) {
  Handle space = make_space(rows, components);
  if (rows == 0 && space.valid() && H5Sselect_none(space) < 0) return {};
  return space;
}

/// Whether the dataset has `rows` x `components` values; one component means one dimension.
std::string check_shape(hid_t dataset, const std::string& column, std::int64_t rows, int components) {
  const Handle space(H5Dget_space(dataset), H5Sclose);
  hsize_t extent[H5S_MAX_RANK] = {0, 1};
  const int dimensions = H5Sget_simple_extent_dims(space, extent, nullptr);
  if (dimensions == (components == 1 ? 1 : 2) && extent[0] == static_cast<hsize_t>(rows) &&
      (components == 1 || extent[1] == static_cast<hsize_t>(components)))
    return {};
  return fmt::format("column {} does not have {} rows of {} values", column, rows, components);
}

}  // namespace

template <class T>
void TableReader::State::read(const std::string& column, int components, const RowBlocks& wanted,
                              std::span<T> values) const {
  require_input(check_rows(wanted, components, values.size()));
  const bool exists = H5Lexists(handle, column.c_str(), H5P_DEFAULT) > 0;
  const Handle dataset(exists ? H5Dopen2(handle, column.c_str(), H5P_DEFAULT) : H5I_INVALID_HID, H5Dclose);
  require_input(dataset.valid() ? check_shape(dataset, column, wanted.total_rows, components)
                                : "it has no column " + column);

  errno = 0;
  const Handle in_memory = memory_space(wanted.local_rows(), components), in_file = select_rows(wanted, components);
  const bool ready = in_memory.valid() && in_file.valid();
  throw_together(comm, ready ? "" : fmt::format("cannot read {}: {}", file.string(), hdf5::error_text()));
  // A dataset without rows has no place in the file, and HDF5 fails to read nothing from there.
  const bool good = wanted.total_rows == 0 ||
                    H5Dread(dataset, hdf5::native_type<T>(), in_memory, in_file, H5P_DEFAULT, values.data()) >= 0;
  throw_together(comm,
                 good ? "" : fmt::format("cannot read {}: column {}: {}", file.string(), column, hdf5::error_text()));
}

TableReader::TableReader(const std::filesystem::path& file, MPI_Comm comm) : state_(std::make_unique<State>()) {
  hdf5::prepare();
  state_->file = file;
  state_->comm = comm;
  std::error_code ignored;
  state_->require_input(std::filesystem::is_regular_file(file, ignored) ? "" : "no such file");
  errno = 0;
  state_->handle = Handle(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  state_->require_input(state_->handle.valid() ? "" : "not a whole HDF5 file: " + hdf5::error_text());
  const Handle root(H5Gopen2(state_->handle, "/", H5P_DEFAULT), H5Gclose);
  const bool complete =
      hdf5::read_attribute(root, "rows", state_->rows) && hdf5::read_attribute(root, "time", state_->time) &&
      hdf5::read_attribute(root, "step", state_->step) && hdf5::read_attribute(root, "kind", state_->kind);
  state_->require_input(complete ? "" : "not a table of cairn: its root lacks rows, time, step or kind");
}

TableReader::~TableReader() = default;

std::int64_t TableReader::rows() const { return state_->rows; }
double TableReader::time() const { return state_->time; }
std::int64_t TableReader::step() const { return state_->step; }
const std::string& TableReader::kind() const { return state_->kind; }

std::int64_t TableReader::rows_of(const std::string& column) const {
  if (H5Lexists(state_->handle, column.c_str(), H5P_DEFAULT) <= 0) return -1;
  const Handle dataset(H5Dopen2(state_->handle, column.c_str(), H5P_DEFAULT), H5Dclose);
  const Handle space(dataset.valid() ? H5Dget_space(dataset) : H5I_INVALID_HID, H5Sclose);
  hsize_t extent[H5S_MAX_RANK] = {0};
  return space.valid() && H5Sget_simple_extent_dims(space, extent, nullptr) >= 1 ? static_cast<std::int64_t>(extent[0])
                                                                                 : -1;
}

bool TableReader::attribute(const std::string& name, double& value) const {
  const Handle root(H5Gopen2(state_->handle, "/", H5P_DEFAULT), H5Gclose);
  return hdf5::read_attribute(root, name, value);
}

bool TableReader::attribute(const std::string& name, std::int64_t& value) const {
  const Handle root(H5Gopen2(state_->handle, "/", H5P_DEFAULT), H5Gclose);
  return hdf5::read_attribute(root, name, value);
}

void TableReader::read(const std::string& column, int components, const RowBlocks& rows,
                       std::span<double> values) const {
  state_->read(column, components, rows, values);
}

void TableReader::read(const std::string& column, int components, const RowBlocks& rows,
                       std::span<std::int32_t> values) const {
  state_->read(column, components, rows, values);
}

void TableReader::read(const std::string& column, int components, const RowBlocks& rows,
                       std::span<std::int64_t> values) const {
  state_->read(column, components, rows, values);
}

void TableReader::read(const std::string& column, int components, const RowBlocks& rows,
                       std::span<std::uint8_t> values) const {
  state_->read(column, components, rows, values);
}

}  // namespace cairn
