#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "cairn/core/error.hpp"
#include "commands.hpp"
#include "pages.hpp"
#include "report.hpp"

namespace cairn::app {
namespace {

/// Writes a file that must not be there yet. \throws InputError
void write_new(const std::filesystem::path& file, std::string_view text) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (descriptor < 0)
    throw InputError(fmt::format("{}: {}", file.string(),
                                 errno == EEXIST ? "is there already and is not replaced; choose another name"
                                                 : fmt::format("cannot be made: {}", std::strerror(errno))));
  bool good = true;
  while (good && !text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    good = written > 0 || (written < 0 && errno == EINTR);
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
  }
  const int reason = errno;
  if (::close(descriptor) == 0 && good) return;
  ::unlink(file.c_str());
  throw RunError(fmt::format("{}: cannot be written: {}", file.string(), std::strerror(good ? errno : reason)));
}

}  // namespace

int command_init(const std::filesystem::path& file) {
  return on_first_rank([&] {
    write_new(file, first_case);
    fmt::print("wrote {}; run it with: cairn run {}\n", file.string(), file.string());
  });
}

}  // namespace cairn::app
