#pragma once
/// One HDF5 file written by all ranks together, which appears under its name only when it is whole.

#include "cairn/io/table_file.hpp"
#include "hdf5.hpp"
#include "posix_file.hpp"

namespace cairn {

/// What is wrong with this rank's blocks for a buffer of `size` values, or empty.
std::string check_rows(const RowBlocks& rows, int components, std::size_t size);

/// The blocks that are not empty; those that follow each other in the file as one.
std::vector<RowBlocks::Block> merged_blocks(const RowBlocks& rows);

/// What the file system says about a failure to write, and what is free there.
std::string write_failure(const std::filesystem::path& file, const std::string& what, const std::string& reason);

/// Flushes a file to disk and gives it its final name, replacing what was there; returns the error, empty if none.
std::string publish(const std::filesystem::path& temporary, const std::filesystem::path& file);

/// `.NAME.part` in the folder of `file`.
std::filesystem::path temporary_name(const std::filesystem::path& file);

/// Creates a file under a temporary name, for writing. What a program that was killed left there is removed; a link
/// that somebody put there goes with it and is never followed. Where it fails, errno says why.
PosixFile create_temporary(const std::filesystem::path& temporary);

/// Every member function is collective, and throws the same RunError on every rank if it fails on any. Destroyed before
/// finish(), the writer removes what it wrote, without communication.
///
/// Rank 0 alone has the file open in HDF5 and lays out its datasets there; each rank then writes its rows to their
/// place by the system's own calls. Ranks agree on errors after each of these steps, so that an error on one of them
/// keeps no other waiting, as it would inside a collective write.
///
/// HDF5 (1.10) cannot close a file whose writing failed: the library then crashes or loops when the program ends. So
/// the space is claimed from the file system before HDF5 writes anything, which finds a full disk, quota or limit
/// early; should writing fail all the same, the file is cut to nothing first, so that HDF5 finds room for what it holds
/// back.
class TableWriter {
 public:
  /// `bytes`: of all datasets together, at least.
  TableWriter(std::filesystem::path file, MPI_Comm comm, std::int64_t bytes);
  ~TableWriter();
  TableWriter(const TableWriter&) = delete;
  TableWriter& operator=(const TableWriter&) = delete;

  void add_group(const std::string& path);
  void add_link(const std::string& path, const std::string& target);
  /// The version and commit of this program, at the root.
  void add_program();
  void add_attribute(const std::string& object, const std::string& name, const hdf5::AttributeValue& value);

  /// Writes a dataset of rows.total_rows (x components) values, each rank its own rows.
  template <class T>
  void write(const std::string& path, int components, const RowBlocks& rows, std::span<const T> values) {
    check(path, rows, components, values.size());
    const RowBlocks merged{merged_blocks(rows), rows.total_rows};
    std::size_t at = 0;
    write_blocks(path, components, merged, hdf5::native_type<T>(), sizeof(T), [&](std::size_t block) {
      const auto size = static_cast<std::size_t>(merged.blocks[block].count * components);
      return std::as_bytes(values.subspan(std::exchange(at, at + size), size));
    });
  }
  /// Likewise, block by block.
  template <class T>
  void write(const std::string& path, int components, const RowBlocks& rows, const BlockSource<T>& values) {
    check(path, rows, components, static_cast<std::size_t>(rows.local_rows() * components));
    write_blocks(path, components, rows, hdf5::native_type<T>(), sizeof(T),
                 [&](std::size_t block) { return std::as_bytes(values(block)); });
  }

  /// Renames; `sealed`: with a checksum of the whole file at its end (seal.hpp), and flushed to disk before.
  void finish(bool sealed = false);

 private:
  void check(const std::string& path, const RowBlocks& rows, int components, std::size_t size);
  void write_blocks(const std::string& path, int components, const RowBlocks& rows, hid_t type, std::size_t value_bytes,
                    const BlockSource<std::byte>& values);
  /// Makes a dataset and says where in the file its values lie.
  std::int64_t lay_out(const std::string& path, int components, std::int64_t total_rows, hid_t type);
  /// Has rank 0 do what returns whether it went well; throws on every rank where it did not.
  template <class F>
  void on_first_rank(const std::string& what, F&& work);
  /// Throws on every rank if `good` is false on any, with the system's last error.
  void require(bool good, const std::string& what);
  void create(std::int64_t bytes);
  /// Closes and removes the unfinished file.
  void discard();
  /// Claims space on rank 0 in the temporary file, or in a new one; throws on every rank if there is not enough.
  void reserve(std::int64_t bytes, bool fresh);

  std::filesystem::path file_, temporary_;
  MPI_Comm comm_;
  int rank_ = 0;
  bool finished_ = false;
  hdf5::Handle handle_;  // on rank 0
  PosixFile rows_;       // where this rank writes its rows
};

}  // namespace cairn
