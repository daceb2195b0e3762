#include "cairn/io/history.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace cairn {
namespace {

std::string header_of(const std::vector<std::string>& columns) { return fmt::format("{}\n", fmt::join(columns, ",")); }

/// Adds the file's content up to a position to `sum`; returns what is wrong with it, empty if nothing is.
std::string read_prefix(const std::filesystem::path& file, const std::vector<std::string>& columns,
                        const CsvPosition& from, Checksum& sum) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return fmt::format("{}: cannot be read", file.string());
  std::vector<char> buffer(std::size_t{1} << 20);
  const std::string header = header_of(columns);
  for (std::int64_t left = from.bytes; left > 0;) {
    stream.read(buffer.data(), std::min<std::int64_t>(left, std::ssize(buffer)));
    const std::int64_t got = stream.gcount();
    if (got == 0)
      return fmt::format("{}: is shorter ({} bytes) than when the checkpoint was written ({})", file.string(),
                         from.bytes - left, from.bytes);
    if (left == from.bytes && !std::string_view(buffer.data(), static_cast<std::size_t>(got)).starts_with(header))
      return fmt::format("{}: its columns are not those of this version or case", file.string());
    sum.add_values(std::span<const char>(buffer).first(static_cast<std::size_t>(got)));
    left -= got;
  }
  if (sum.value() != from.checksum)
    return fmt::format("{}: is not as the run of the checkpoint left it", file.string());
  return {};
}

/// Removes what an earlier run left under that name: a file whose header begins alike. Returns the error, empty if
/// none.
std::string remove_earlier(const std::filesystem::path& file, const std::vector<std::string>& columns) {
  struct stat facts = {};
  if (::lstat(file.c_str(), &facts) != 0) return {};
  const std::string start = fmt::format(
      "{}", fmt::join(columns.begin(), columns.begin() + std::min<std::ptrdiff_t>(3, std::ssize(columns)), ","));
  std::string head(start.size(), '\0');
  if (S_ISREG(facts.st_mode)) std::ifstream(file, std::ios::binary).read(head.data(), std::ssize(head));
  if (!S_ISREG(facts.st_mode) || (facts.st_size > 0 && head != start))
    return fmt::format("cannot create {}: something is there that cairn did not write", file.string());
  return ::unlink(file.c_str()) == 0 ? "" : fmt::format("cannot replace {}: {}", file.string(), std::strerror(errno));
}

}  // namespace

std::string check_prefix(const std::filesystem::path& file, const std::vector<std::string>& columns,
                         const CsvPosition& from) {
  Checksum sum;
  return read_prefix(file, columns, from, sum);
}

CsvWriter::CsvWriter(std::filesystem::path file, std::vector<std::string> columns)
    : file_(std::move(file)), columns_(columns.size()) {
  error_ = remove_earlier(file_, columns);
  if (!error_.empty()) return;
  descriptor_ = ::open(file_.c_str(), O_CREAT | O_EXCL | O_NOFOLLOW | O_WRONLY | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor_ < 0) {
    error_ = fmt::format("cannot create {}: {}", file_.string(), std::strerror(errno));
    return;
  }
  append(header_of(columns));
}

CsvWriter::CsvWriter(std::filesystem::path file, std::vector<std::string> columns, const CsvPosition& from)
    : file_(std::move(file)), columns_(columns.size()), bytes_(from.bytes) {
  error_ = read_prefix(file_, columns, from, sum_);
  if (!error_.empty()) return;
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor_ < 0 || ::ftruncate(descriptor_, from.bytes) != 0)
    error_ = fmt::format("cannot go on with {}: {}", file_.string(), std::strerror(errno));
}

CsvWriter::~CsvWriter() {
  if (descriptor_ < 0) return;
  ::fsync(descriptor_);
  ::close(descriptor_);
}

CsvWriter::CsvWriter(CsvWriter&& other) noexcept
    : file_(std::move(other.file_)),
      columns_(other.columns_),
      descriptor_(std::exchange(other.descriptor_, -1)),
      bytes_(other.bytes_),
      sum_(std::move(other.sum_)),
      error_(std::move(other.error_)) {}

CsvWriter& CsvWriter::operator=(CsvWriter&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(columns_, other.columns_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(bytes_, other.bytes_);
  std::swap(sum_, other.sum_);
  std::swap(error_, other.error_);
  return *this;
}

void CsvWriter::add_row(std::span<const CsvValue> values) {
  if (descriptor_ < 0) return;
  if (values.size() != columns_)
    throw std::logic_error(fmt::format("{}: {} values for {} columns", file_.string(), values.size(), columns_));
  std::string line;
  for (const auto& value : values) {
    if (!line.empty()) line += ',';
    std::visit([&](const auto& number) { fmt::format_to(std::back_inserter(line), "{}", number); }, value);
  }
  append(line + '\n');
}

void CsvWriter::flush() {
  if (descriptor_ >= 0 && error_.empty() && ::fsync(descriptor_) != 0 && errno != EINVAL)
    error_ = fmt::format("cannot flush {}: {}", file_.string(), std::strerror(errno));
}

void CsvWriter::append(const std::string& line) {
  if (!error_.empty()) return;
  const ssize_t written = ::write(descriptor_, line.data(), line.size());
  if (written == static_cast<ssize_t>(line.size())) {
    bytes_ += written;
    sum_.add_values(std::span<const char>(line));
    struct stat facts = {};
    if (::fstat(descriptor_, &facts) == 0 && facts.st_nlink == 0)
      error_ = fmt::format("cannot write {}: it was removed while the run wrote it", file_.string());
    return;
  }
  const int reason = written < 0 ? errno : ENOSPC;  // the system wrote what still fitted
  error_ = fmt::format("cannot write {}: {}", file_.string(), std::strerror(reason));
  if (written <= 0) return;
  const off_t end = ::lseek(descriptor_, 0, SEEK_END);
  if (end < 0 || ::ftruncate(descriptor_, end - written) != 0) error_ += "; its last line is incomplete";
}

}  // namespace cairn
