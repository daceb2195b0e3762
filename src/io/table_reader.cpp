#include <fmt/format.h>

#include <cerrno>
#include <cstring>

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
  PosixFile data;  // for the values
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

/// Where in the file the values of a dataset lie, one after the other as in memory: -1 where they do not. Without rows
/// they lie nowhere.
template <class T>
std::int64_t place_of(hid_t dataset, std::int64_t file_bytes) {
  const Handle space(H5Dget_space(dataset), H5Sclose), type(H5Dget_type(dataset), H5Tclose);
  if (H5Tequal(type, hdf5::native_type<T>()) <= 0) return -1;
  if (H5Sget_simple_extent_npoints(space) == 0) return 0;
  const haddr_t place = H5Dget_offset(dataset);
  if (place == HADDR_UNDEF || place >= static_cast<haddr_t>(file_bytes)) return -1;
  const auto values = static_cast<double>(H5Sget_simple_extent_npoints(space));
  const double end = static_cast<double>(place) + values * sizeof(T);
  return end <= static_cast<double>(file_bytes) ? static_cast<std::int64_t>(place) : -1;
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

  const std::int64_t row_bytes = components * static_cast<std::int64_t>(sizeof(T)),
                     place = place_of<T>(dataset, data.size());
  require_input(place >= 0 ? "" : fmt::format("column {} is not stored as one piece of this type in the file", column));
  auto* bytes = reinterpret_cast<char*>(values.data());
  std::string error;
  for (const auto& block : merged_blocks(wanted)) {
    const std::int64_t count = block.count * row_bytes;
    if (error.empty() && !data.read(bytes, count, place + block.file_row * row_bytes))
      error = fmt::format("cannot read {}: column {}: {}", file.string(), column,
                          errno != 0 ? std::strerror(errno) : "it ends early");
    bytes += count;
  }
  throw_together(comm, error);
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
  state_->data = PosixFile(file, O_RDONLY);
  state_->require_input(state_->data.valid() ? "" : std::strerror(errno));
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
  if (!space.valid() || H5Sget_simple_extent_dims(space, extent, nullptr) < 1) return -1;
  // A file can say that it has more values than it holds bytes.
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const double bytes =
      static_cast<double>(H5Sget_simple_extent_npoints(space)) * static_cast<double>(H5Tget_size(type));
  const auto most = static_cast<double>(state_->data.size());
  return bytes <= most && static_cast<double>(extent[0]) <= most ? static_cast<std::int64_t>(extent[0]) : -1;
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
