#pragma once
/// The lock of a folder of results: one run at a time writes there.
///
/// The file `.cairn.lock` in the folder is locked by the system (fcntl), so that the lock ends with the process,
/// however that ends; NFS passes such locks on to its server, so that they hold across machines. The file names host
/// and process for the message. Where a file system has no locks, the file alone must do: it is made only where there
/// is none, and one of a process of this host that is gone is taken over; of another host that cannot be known, and the
/// message says which file to remove.

#include <filesystem>

#include "cairn/core/error.hpp"

namespace cairn {

/// Held by one process, that of rank 0, while it lives. Not collective.
class FolderLock {
 public:
  FolderLock() = default;
  /// \throws InputError naming host and process that hold the lock. `system_locks` = false: as on a file system
  /// without.
  explicit FolderLock(const std::filesystem::path& folder, bool system_locks = true);
  ~FolderLock() { release(); }
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&& other) noexcept;

  /// Ends the lock and removes its file.
  void release();

 private:
  bool acquire(const std::filesystem::path& folder, bool system_locks);

  std::filesystem::path file_;
  int descriptor_ = -1;
};

}  // namespace cairn
