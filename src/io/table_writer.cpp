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
#include "cairn/io/program_facts.hpp"
#include "seal.hpp"

namespace cairn {

namespace {

using hdf5::Handle;

constexpr double mebibyte = 1024.0 * 1024.0;

/// A dataset whose values lie in one piece from the start, without time stamps (the same run gives the same bytes) and
/// without fill values (every row is written). Columns of one component are one-dimensional.
Handle create_dataset(hid_t file, const std::string& path, hid_t type, std::int64_t rows, int components) {
  const hsize_t extent[2] = {static_cast<hsize_t>(rows), static_cast<hsize_t>(components)};
  const Handle space(H5Screate_simple(components == 1 ? 1 : 2, extent, nullptr), H5Sclose);
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  if (H5Pset_layout(properties, H5D_CONTIGUOUS) < 0 || H5Pset_alloc_time(properties, H5D_ALLOC_TIME_EARLY) < 0 ||
      H5Pset_obj_track_times(properties, false) < 0 || H5Pset_fill_time(properties, H5D_FILL_TIME_NEVER) < 0)
    return {};
  return {H5Dcreate2(file, path.c_str(), type, space, H5P_DEFAULT, properties, H5P_DEFAULT), H5Dclose};
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

/// Has the disk hold the name of a file. Some file systems cannot flush a folder; the file is whole in any case.
void flush_name(const std::filesystem::path& file) {
  const PosixFile folder(folder_of(file), O_RDONLY | O_DIRECTORY);
  if (folder.valid()) folder.flush();
}

}  // namespace

std::vector<RowBlocks::Block> merged_blocks(const RowBlocks& rows) {
  std::vector<RowBlocks::Block> merged;
  for (const auto& block : rows.blocks) {
    if (block.count == 0) continue;
    if (!merged.empty() && merged.back().file_row + merged.back().count == block.file_row)
      merged.back().count += block.count;
    else
      merged.push_back(block);
  }
  return merged;
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

PosixFile create_temporary(const std::filesystem::path& temporary) {
  if (::unlink(temporary.c_str()) != 0 && errno != ENOENT) return {};
  return {temporary, O_CREAT | O_EXCL | O_NOFOLLOW | O_WRONLY};
}

std::string write_failure(const std::filesystem::path& file, const std::string& what, const std::string& reason) {
  std::error_code error;
  const auto space = std::filesystem::space(folder_of(file), error);
  const std::string free =
      error ? "" : fmt::format(" ({:.1f} MiB free on that disk)", static_cast<double>(space.available) / mebibyte);
  return fmt::format("cannot write {}: {}: {}{}", file.string(), what, reason, free);
}

std::string flush_to_disk(const std::filesystem::path& file) {
  const PosixFile open(file, O_RDWR | O_NOFOLLOW);
  if (!open.valid() || !open.flush()) return write_failure(file, "flushing to disk", std::strerror(errno));
  flush_name(file);
  return {};
}

std::string rename_to(const std::filesystem::path& temporary, const std::filesystem::path& file) {
  if (::rename(temporary.c_str(), file.c_str()) == 0) return {};
  return write_failure(file, "renaming", std::strerror(errno));
}

std::string publish(const std::filesystem::path& temporary, const std::filesystem::path& file) {
  std::string error = flush_to_disk(temporary);
  if (error.empty()) error = rename_to(temporary, file);
  if (error.empty()) flush_name(file);
  return error;
}

TableWriter::TableWriter(std::filesystem::path file, MPI_Comm comm, std::int64_t bytes)
    : file_(std::move(file)), temporary_(temporary_name(file_)), comm_(comm) {
  hdf5::prepare();
  MPI_Comm_rank(comm_, &rank_);
  try {
    create(bytes);
  } catch (const RunError&) {
    discard();
    throw;
  }
}

template <class F>
void TableWriter::on_first_rank(const std::string& what, F&& work) {
  std::string error;
  errno = 0;
  if (rank_ == 0 && !work()) error = write_failure(file_, what, hdf5::error_text());
  throw_together(comm_, error);
}

void TableWriter::require(bool good, const std::string& what) {
  throw_together(comm_, good ? "" : write_failure(file_, what, std::strerror(errno)));
}

void TableWriter::create(std::int64_t bytes) {
  constexpr std::int64_t metadata = 128 * 1024;
  reserve(bytes + metadata, true);
  on_first_rank("creating the file", [&] {
    handle_ = Handle(H5Fcreate(temporary_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    return handle_.valid();
  });
  reserve(bytes + metadata, false);  // HDF5 has emptied the file
  rows_ = PosixFile(temporary_, O_WRONLY | O_NOFOLLOW);
  require(rows_.valid(), "opening the file");
}

void TableWriter::reserve(std::int64_t bytes, bool fresh) {
  std::string error;
  if (rank_ == 0) {
    const PosixFile file = fresh ? create_temporary(temporary_) : PosixFile(temporary_, O_WRONLY | O_NOFOLLOW);
    const int mode = fresh ? 0 : FALLOC_FL_KEEP_SIZE;
    if (!file.valid())
      error = write_failure(file_, "creating the file", std::strerror(errno));
    else if (const int reason = claim_space(file.descriptor(), mode, bytes); reason != 0)
      error = write_failure(file_, fmt::format("claiming {:.1f} MiB", static_cast<double>(bytes) / mebibyte),
                            std::strerror(reason));
  }
  throw_together(comm_, error);
}

TableWriter::~TableWriter() {
  if (!finished_) discard();
}

void TableWriter::discard() {
  if (rank_ != 0) return;
  if (::truncate(temporary_.c_str(), 0) != 0) errno = 0;  // nothing better can be done here
  handle_.close();
  ::unlink(temporary_.c_str());
}

void TableWriter::add_group(const std::string& path) {
  on_first_rank("creating group " + path, [&] {
    return Handle(H5Gcreate2(handle_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose).valid();
  });
}

void TableWriter::add_link(const std::string& path, const std::string& target) {
  on_first_rank("linking " + path,
                [&] { return H5Lcreate_soft(target.c_str(), handle_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT) >= 0; });
}

void TableWriter::add_attribute(const std::string& object, const std::string& name, const hdf5::AttributeValue& value) {
  on_first_rank("attribute " + name, [&] {
    const Handle owner(H5Oopen(handle_, object.c_str(), H5P_DEFAULT), H5Oclose);
    return owner.valid() && hdf5::write_attribute(owner, name, value);
  });
}

void TableWriter::add_program() {
  add_attribute("/", "version", program_facts().version);
  add_attribute("/", "commit", program_facts().commit);
}

std::int64_t TableWriter::lay_out(const std::string& path, int components, std::int64_t total_rows, hid_t type) {
  std::int64_t place = 0;
  on_first_rank("creating dataset " + path, [&] {
    const Handle dataset = create_dataset(handle_, path, type, total_rows, components);
    if (!dataset.valid()) return false;
    const haddr_t at = total_rows > 0 ? H5Dget_offset(dataset) : 0;  // a dataset without rows has no place
    place = static_cast<std::int64_t>(at);
    return at != HADDR_UNDEF;
  });
  MPI_Bcast(&place, 1, MPI_INT64_T, 0, comm_);
  return place;
}

void TableWriter::check(const std::string& path, const RowBlocks& rows, int components, std::size_t size) {
  const std::string wrong = check_rows(rows, components, size);
  throw_together(comm_,
                 wrong.empty() ? "" : fmt::format("cannot write {}: dataset {}: {}", file_.string(), path, wrong));
}

void TableWriter::write_blocks(const std::string& path, int components, const RowBlocks& rows, hid_t type,
                               std::size_t value_bytes, const BlockSource<std::byte>& values) {
  const std::int64_t place = lay_out(path, components, rows.total_rows, type);
  const std::int64_t row_bytes = components * static_cast<std::int64_t>(value_bytes);
  bool good = true;
  for (std::size_t i = 0; i < rows.blocks.size() && good; ++i) {
    const auto& block = rows.blocks[i];
    if (block.count == 0) continue;
    const std::span<const std::byte> bytes = values(i);
    errno = EINVAL;  // unless they are as many as they have to be
    good = std::ssize(bytes) == block.count * row_bytes &&
           rows_.write(bytes.data(), std::ssize(bytes), place + block.file_row * row_bytes);
  }
  require(good, "dataset " + path);
}

void TableWriter::finish(bool sealed) {
  const bool flushed = !sealed || rows_.flush();
  require(flushed && rows_.close(), "flushing");
  on_first_rank("flushing", [&] { return H5Fflush(handle_, H5F_SCOPE_GLOBAL) >= 0; });
  on_first_rank("closing the file", [&] { return handle_.close(); });
  const std::string unsealed = sealed ? seal(temporary_, comm_) : "";
  throw_together(comm_, unsealed.empty() ? "" : write_failure(file_, "sealing the file", unsealed));
  std::string error;
  if (rank_ == 0) error = sealed ? publish(temporary_, file_) : rename_to(temporary_, file_);
  throw_together(comm_, error);
  finished_ = true;
}

}  // namespace cairn
