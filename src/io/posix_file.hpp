#pragma once
/// A file by the system's own calls: reads and writes of any size at any place.

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <utility>

namespace cairn {

/// Closes itself when it goes out of scope. Where a member fails, errno says why.
class PosixFile {
 public:
  PosixFile() = default;
  PosixFile(const std::filesystem::path& file, int flags)
      : descriptor_(::open(file.c_str(), flags | O_CLOEXEC, 0666)) {}
  PosixFile(PosixFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  PosixFile& operator=(PosixFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  ~PosixFile() { close(); }

  bool valid() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }
  /// -1 where it is no regular file.
  std::int64_t size() const {
    struct stat facts = {};
    return ::fstat(descriptor_, &facts) == 0 && S_ISREG(facts.st_mode) ? facts.st_size : -1;
  }
  /// Reads exactly `size` bytes. False where that fails; errno is 0 where the file ends early.
  bool read(void* to, std::int64_t size, std::int64_t at) const {
    auto* bytes = static_cast<char*>(to);
    return transfer(size, [&](std::int64_t done, std::int64_t left) {
      return ::pread(descriptor_, bytes + done, static_cast<std::size_t>(left), at + done);
    });
  }
  bool write(const void* from, std::int64_t size, std::int64_t at) const {
    const auto* bytes = static_cast<const char*>(from);
    const bool written = transfer(size, [&](std::int64_t done, std::int64_t left) {
      return ::pwrite(descriptor_, bytes + done, static_cast<std::size_t>(left), at + done);
    });
    if (!written && errno == 0) errno = ENOSPC;
    return written;
  }
  bool flush() const { return ::fsync(descriptor_) == 0; }
  /// False where the system reports an error of an earlier write only now.
  bool close() { return descriptor_ < 0 || ::close(std::exchange(descriptor_, -1)) == 0; }

 private:
  template <class F>
  static bool transfer(std::int64_t size, const F& some) {
    for (std::int64_t done = 0; done < size;) {
      errno = 0;
      const ssize_t got = some(done, size - done);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      done += got;
    }
    return true;
  }

  int descriptor_ = -1;
};

}  // namespace cairn
