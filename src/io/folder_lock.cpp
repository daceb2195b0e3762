#include "cairn/io/folder_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

namespace cairn {
namespace {

/// Who holds a lock, as its file says.
struct Holder {
  long process = 0;
  std::string host;
};

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown host";
}

std::string text_of(const Holder& holder) { return fmt::format("process {} on {}\n", holder.process, holder.host); }

/// What a lock's file says; process 0 where it says nothing that can be understood.
Holder read_holder(int descriptor) {
  std::array<char, 512> buffer{};
  const ssize_t size = ::pread(descriptor, buffer.data(), buffer.size(), 0);
  std::string_view text(buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  constexpr std::string_view start = "process ", middle = " on ";
  Holder holder;
  if (!text.starts_with(start)) return holder;
  text.remove_prefix(start.size());
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), holder.process);
  if (status != std::errc{}) return {};
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (!text.starts_with(middle)) return {};
  for (const char c : text.substr(middle.size(), text.find('\n') - middle.size()))
    holder.host += static_cast<unsigned char>(c) < 32 || c == 127 ? '?' : c;
  return holder;
}

/// A process of this host that is no more.
bool is_gone(const Holder& holder) {
  return holder.process > 0 && holder.host == host_name() && ::kill(static_cast<pid_t>(holder.process), 0) != 0 &&
         errno == ESRCH;
}

enum class Outcome { locked, held, no_locks };

/// Asks the system for the lock on an open file. The lock belongs to the open file where the system knows such locks,
/// so that nothing else in the process can give it up.
Outcome lock(int descriptor) {
  struct flock wanted = {};
  wanted.l_type = F_WRLCK;
  wanted.l_whence = SEEK_SET;
#ifdef F_OFD_SETLK
  if (::fcntl(descriptor, F_OFD_SETLK, &wanted) == 0) return Outcome::locked;
  if (errno == EACCES || errno == EAGAIN) return Outcome::held;
  if (errno != EINVAL) return Outcome::no_locks;
#endif
  if (::fcntl(descriptor, F_SETLK, &wanted) == 0) return Outcome::locked;
  return errno == EACCES || errno == EAGAIN ? Outcome::held : Outcome::no_locks;
}

[[noreturn]] void refuse(const std::filesystem::path& folder, const Holder& holder, const std::string& more) {
  throw InputError(fmt::format("--out: {}: another run writes there: {}{}", folder.string(),
                               holder.process > 0 ? fmt::format("process {} on {}", holder.process, holder.host)
                                                  : std::string("its lock names no process"),
                               more));
}

/// The file is still the one that is open: its last holder removes it.
bool is_at(int descriptor, const std::filesystem::path& file) {
  struct stat open = {}, named = {};
  return ::fstat(descriptor, &open) == 0 && ::lstat(file.c_str(), &named) == 0 && open.st_dev == named.st_dev &&
         open.st_ino == named.st_ino;
}

/// Writes who holds the lock; false where there is no room.
bool write_holder(int descriptor) {
  const std::string text = text_of({::getpid(), host_name()});
  return ::ftruncate(descriptor, 0) == 0 &&
         ::pwrite(descriptor, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size());
}

/// Without the system's locks: takes over the file of a process that is gone. A second file keeps two programs from
/// doing so at once.
bool take_over(int descriptor, const std::filesystem::path& file) {
  const std::filesystem::path guard = file.string() + ".taken";
  const int guarding = ::open(guard.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (guarding < 0) return false;
  const bool taken = is_at(descriptor, file) && is_gone(read_holder(descriptor)) && write_holder(descriptor);
  ::unlink(guard.c_str());
  ::close(guarding);
  return taken;
}

/// Opens the lock's file, which may be new; -1 where it went away in between. \throws InputError
int open_lock(const std::filesystem::path& folder, const std::filesystem::path& file, bool& made) {
  constexpr int flags = O_RDWR | O_NOFOLLOW | O_CLOEXEC;
  int descriptor = ::open(file.c_str(), flags | O_CREAT | O_EXCL, 0666);
  made = descriptor >= 0;
  if (!made && errno == EEXIST) descriptor = ::open(file.c_str(), flags);
  if (descriptor < 0 && errno != ENOENT)
    throw InputError(fmt::format("--out: {}: the folder cannot be locked: {}: {}", folder.string(), file.string(),
                                 std::strerror(errno)));
  return descriptor;
}

}  // namespace

FolderLock::FolderLock(const std::filesystem::path& folder, bool system_locks) : file_(folder / ".cairn.lock") {
  constexpr int attempts = 100;  // each other run that ends meanwhile takes one
  for (int i = 0; i < attempts; ++i)
    if (acquire(folder, system_locks)) return;
  throw InputError(fmt::format("--out: {}: the lock {} comes and goes; if no other run works there, remove it",
                               folder.string(), file_.string()));
}

/// False where the file went away in the meantime, and the whole has to be tried again.
bool FolderLock::acquire(const std::filesystem::path& folder, bool system_locks) {
  bool made = false;
  const int descriptor = open_lock(folder, file_, made);
  if (descriptor < 0) return false;
  const Outcome outcome = system_locks ? lock(descriptor) : Outcome::no_locks;
  bool mine = false;
  if (outcome == Outcome::locked)
    mine = is_at(descriptor, file_) && (write_holder(descriptor), true);  // the name is a help only
  else if (outcome == Outcome::no_locks)
    mine = made ? write_holder(descriptor) : take_over(descriptor, file_);
  if (mine) {
    descriptor_ = descriptor;
    return true;
  }
  const bool there = is_at(descriptor, file_);
  const Holder holder = read_holder(descriptor);
  ::close(descriptor);
  if (!there || (outcome == Outcome::no_locks && is_gone(holder))) return false;
  refuse(folder, holder,
         outcome == Outcome::held
             ? "; wait for it, or choose another folder"
             : fmt::format("; if it has ended, remove {} (this file system has no locks)", file_.string()));
}

FolderLock::FolderLock(FolderLock&& other) noexcept
    : file_(std::move(other.file_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderLock& FolderLock::operator=(FolderLock&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

void FolderLock::release() {
  if (descriptor_ < 0) return;
  if (is_at(descriptor_, file_)) ::unlink(file_.c_str());  // before the lock ends: nobody else can have it yet
  ::close(std::exchange(descriptor_, -1));
}

}  // namespace cairn
