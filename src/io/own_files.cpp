#include "cairn/io/own_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "cairn/io/result_files.hpp"
#include "cairn/io/run_record.hpp"
#include "posix_file.hpp"
#include "shape_copies.hpp"

namespace cairn {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t head_bytes = 1 << 16;

/// The first bytes of a file; fewer where it is shorter or cannot be read.
std::string head_of(const PosixFile& file) {
  std::string head(static_cast<std::size_t>(std::clamp<std::int64_t>(file.size(), 0, head_bytes)), '\0');
  return file.read(head.data(), std::ssize(head), 0) ? head : std::string();
}

/// An HDF5 file whose root has the attribute `kind`, as all tables of this program have. The bytes are looked at rather
/// than given to the HDF5 library, which damaged files can crash.
bool is_table(std::string_view head) {
  using namespace std::string_view_literals;
  return head.starts_with("\x89HDF\r\n\x1a\n"sv) && head.find("kind\0"sv) != head.npos;
}

/// True where the head of a file says that this program wrote it as the result of that name.
bool is_marked(const std::string& name, std::string_view head) {
  if (name == "case.toml") return head.starts_with(case_mark);
  if (name == record_file) return head.starts_with(record_mark);
  if (name.starts_with("case_grains_")) return head.starts_with(table_mark);
  if (name == "history.csv") return head.starts_with("step,time,dt,");
  if (name == "tips.csv") return head.starts_with("step,time,crack,");
  if (name == "forces.csv") return head.starts_with("step,time,tool,");
  if (name == "bodies.csv") return head.starts_with("step,time,body,");
  if (name.ends_with(".series")) return head.starts_with("{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n");
  return is_table(head);
}

template <class F>
std::string foreign(const fs::path& file, const F& is_own) {
  const auto fail = [&](const std::string& text) { return fmt::format("{}: {}", file.string(), text); };
  struct stat facts = {};
  if (::lstat(file.c_str(), &facts) != 0)
    return errno == ENOENT ? "" : fail(fmt::format("cannot be looked at: {}", std::strerror(errno)));
  if (S_ISLNK(facts.st_mode))
    return fail("is a link, which is neither followed nor replaced; remove it or choose another name");
  if (S_ISDIR(facts.st_mode)) return fail("is a folder; choose another name");
  if (!S_ISREG(facts.st_mode)) return fail("is not a regular file (a device, pipe or socket); choose another name");
  if (facts.st_size == 0) return {};
  const PosixFile open(file, O_RDONLY | O_NOFOLLOW);
  if (!open.valid()) return fail(fmt::format("cannot be read: {}", std::strerror(errno)));
  return is_own(head_of(open)) ? ""
                               : fail("was not written by cairn and would be replaced; move it or choose another name");
}

}  // namespace

std::string foreign_result(const fs::path& file) {
  const std::string name = file.filename().string();
  return foreign(file, [&](std::string_view head) {
    if (name.starts_with(reading::shape_copy))
      return reading::is_shape_copy(name, PosixFile(file, O_RDONLY | O_NOFOLLOW));
    return is_marked(name, head);
  });
}

std::string foreign_pack(const fs::path& file) {
  return foreign(file, [](std::string_view head) {
    return head.starts_with("# ") &&
           head.substr(0, head.find('\n')).ends_with(" grains, made by cairn pack from this spec:");
  });
}

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  return fs::equivalent(a, b, ignored);
}

}  // namespace cairn
