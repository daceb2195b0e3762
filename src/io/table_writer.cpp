#include "table_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "cairn/core/error.hpp"
#include "cairn/io/agreement.hpp"
#include "seal.hpp"

namespace cairn {

namespace {

using hdf5::Handle;

constexpr double mebibyte = 1024.0 * 1024.0;

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

Handle file_access(MPI_Comm comm) {
  Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  if (H5Pset_fapl_mpio(access, comm, MPI_INFO_NULL) < 0) return {};
  return access;
}

/// Datasets without time stamps (the same run gives the same bytes) and without fill values (every row is written).
Handle create_dataset(hid_t file, const std::string& path, hid_t type, hid_t space) {
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  if (H5Pset_obj_track_times(properties, false) < 0 || H5Pset_fill_time(properties, H5D_FILL_TIME_NEVER) < 0) return {};
  return {H5Dcreate2(file, path.c_str(), type, space, H5P_DEFAULT, properties, H5P_DEFAULT), H5Dclose};
}

/// Opens a path, has it flushed to disk and closes it; 0 or the system's error.
int flush_to_disk(const std::filesystem::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags);
  if (descriptor < 0) return errno;
  const int error = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  return error;
}

/// Claims space for a file; 0 or the system's error. Where the file system cannot claim, it is asked what is free.
int claim_space(int descriptor, int mode, std::int64_t bytes) {
  if (::fallocate(descriptor, mode, 0, bytes) == 0) return 0;
  if (errno != EOPNOTSUPP && errno != ENOSYS) return errno;
  struct statvfs space = {};
  if (::fstatvfs(descriptor, &space) != 0) return 0;
  const double available = static_cast<double>(space.f_bavail) * static_cast<double>(space.f_frsize);
  return available < static_cast<double>(bytes) ? ENOSPC : 0;
}

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

}  // namespace

Handle select_rows(const RowBlocks& rows, int components) {
  std::vector<RowBlocks::Block> merged;
  for (const auto& block : rows.blocks) {
    if (block.count == 0) continue;
    if (!merged.empty() && merged.back().file_row + merged.back().count == block.file_row)
      merged.back().count += block.count;
    else
      merged.push_back(block);
  }
  return select_blocks(merged, rows.total_rows, components);
}

Handle memory_space(std::int64_t rows, int components) {
  Handle space = make_space(rows, components);
  if (rows == 0 && space.valid() && H5Sselect_none(space) < 0) return {};
  return space;
}

std::string check_rows(const RowBlocks& rows, int components, std::size_t size) {
  std::int64_t next = 0;
  for (const auto& block : rows.blocks) {
    if (block.count < 0 || block.file_row < next || block.file_row + block.count > rows.total_rows)
      return fmt::format("the block of {} rows at row {} does not lie between row {} and row {}", block.count,
                         block.file_row, next, rows.total_rows);
    next = block.file_row + block.count;
  }
  const auto expected = static_cast<std::size_t>(rows.local_rows()) * static_cast<std::size_t>(components);
  if (size != expected) return fmt::format("{} values for {} rows of {}", size, rows.local_rows(), components);
  return {};
}

std::filesystem::path temporary_name(const std::filesystem::path& file) {
  return folder_of(file) / fmt::format(".{}.part", file.filename().string());
}

std::string write_failure(const std::filesystem::path& file, const std::string& what, const std::string& reason) {
  std::error_code error;
  const auto space = std::filesystem::space(folder_of(file), error);
  const std::string free =
      error ? "" : fmt::format(" ({:.1f} MiB free on that disk)", static_cast<double>(space.available) / mebibyte);
  return fmt::format("cannot write {}: {}: {}{}", file.string(), what, reason, free);
}

std::string publish(const std::filesystem::path& temporary, const std::filesystem::path& file) {
  int error = flush_to_disk(temporary, O_RDWR);
  if (error == 0 && ::rename(temporary.c_str(), file.c_str()) != 0) error = errno;
  // Some file systems cannot flush a folder; the renamed file is whole in any case.
  if (error == 0) flush_to_disk(folder_of(file), O_RDONLY | O_DIRECTORY);
  return error == 0 ? "" : write_failure(file, "flushing and renaming", std::strerror(error));
}

TableWriter::TableWriter(std::filesystem::path file, MPI_Comm comm, std::int64_t bytes)
    : file_(std::move(file)), temporary_(temporary_name(file_)), comm_(comm) {
  hdf5::silence();
  MPI_Comm_rank(comm_, &rank_);
  try {
    create(bytes);
  } catch (const RunError&) {
    discard();
    throw;
  }
}

void TableWriter::create(std::int64_t bytes) {
  constexpr std::int64_t metadata = 128 * 1024;
  reserve(bytes + metadata, 0);
  errno = 0;
  const Handle access = file_access(comm_);
  handle_ = Handle(H5Fcreate(temporary_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  require(handle_.valid(), "creating the file");
  reserve(bytes + metadata, FALLOC_FL_KEEP_SIZE);  // HDF5 has emptied the file
}

void TableWriter::reserve(std::int64_t bytes, int mode) {
  std::string error;
  if (rank_ == 0) {
    const int descriptor = ::open(temporary_.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0666);
    if (descriptor < 0)
      error = write_failure(file_, "creating the file", std::strerror(errno));
    else if (const int reason = claim_space(descriptor, mode, bytes); reason != 0)
      error = write_failure(file_, fmt::format("claiming {:.1f} MiB", static_cast<double>(bytes) / mebibyte),
                            std::strerror(reason));
    if (descriptor >= 0) ::close(descriptor);
  }
  throw_together(comm_, error);
}

TableWriter::~TableWriter() {
  if (!finished_) discard();
}

void TableWriter::discard() {
  if (rank_ == 0 && ::truncate(temporary_.c_str(), 0) != 0) errno = 0;  // nothing better can be done here
  MPI_Barrier(comm_);
  handle_.close();
  if (rank_ == 0) ::unlink(temporary_.c_str());
}

void TableWriter::require(bool good, const std::string& what) {
  throw_together(comm_, good ? "" : write_failure(file_, what, hdf5::error_text()));
}

void TableWriter::add_group(const std::string& path) {
  errno = 0;
  const Handle group(H5Gcreate2(handle_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  require(group.valid(), "creating group " + path);
}

void TableWriter::add_link(const std::string& path, const std::string& target) {
  errno = 0;
  require(H5Lcreate_soft(target.c_str(), handle_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT) >= 0, "linking " + path);
}

void TableWriter::add_attribute(const std::string& object, const std::string& name, const hdf5::AttributeValue& value) {
  errno = 0;
  const Handle owner(H5Oopen(handle_, object.c_str(), H5P_DEFAULT), H5Oclose);
  require(owner.valid() && hdf5::write_attribute(owner, name, value), "attribute " + name);
}

void TableWriter::write_rows(const std::string& path, int components, const RowBlocks& rows, hid_t type,
                             const void* values, std::size_t size) {
  const std::string wrong = check_rows(rows, components, size);
  throw_together(comm_,
                 wrong.empty() ? "" : fmt::format("cannot write {}: dataset {}: {}", file_.string(), path, wrong));
  errno = 0;
  const Handle in_memory = memory_space(rows.local_rows(), components);
  const Handle in_file = select_rows(rows, components);
  const Handle transfer(H5Pcreate(H5P_DATASET_XFER), H5Pclose);
  require(in_memory.valid() && in_file.valid() && H5Pset_dxpl_mpio(transfer, H5FD_MPIO_COLLECTIVE) >= 0,
          "preparing dataset " + path);
  Handle dataset = create_dataset(handle_, path, type, in_file);
  require(dataset.valid(), "creating dataset " + path);
  errno = 0;
  // HDF5 gives a dataset without rows no place in the file, and fails to write nothing there.
  require(rows.total_rows == 0 || H5Dwrite(dataset, type, in_memory, in_file, transfer, values) >= 0,
          "dataset " + path);
  errno = 0;
  require(dataset.close(), "closing dataset " + path);
}

void TableWriter::finish(bool sealed) {
  errno = 0;
  require(H5Fflush(handle_, H5F_SCOPE_GLOBAL) >= 0, "flushing");
  errno = 0;
  require(handle_.close(), "closing the file");
  const std::string unsealed = sealed ? seal(temporary_, comm_) : "";
  throw_together(comm_, unsealed.empty() ? "" : write_failure(file_, "sealing the file", unsealed));
  throw_together(comm_, rank_ == 0 ? publish(temporary_, file_) : "");
  finished_ = true;
}

}  // namespace cairn
