#include "cairn/io/history.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace cairn {

CsvWriter::CsvWriter(std::filesystem::path file, std::vector<std::string> columns)
    : file_(std::move(file)), columns_(columns.size()) {
  descriptor_ = ::open(file_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor_ < 0) {
    error_ = fmt::format("cannot create {}: {}", file_.string(), std::strerror(errno));
    return;
  }
  append(fmt::format("{}\n", fmt::join(columns, ",")));
}

CsvWriter::~CsvWriter() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

CsvWriter::CsvWriter(CsvWriter&& other) noexcept
    : file_(std::move(other.file_)),
      columns_(other.columns_),
      descriptor_(std::exchange(other.descriptor_, -1)),
      error_(std::move(other.error_)) {}

CsvWriter& CsvWriter::operator=(CsvWriter&& other) noexcept {
  std::swap(file_, other.file_);
  std::swap(columns_, other.columns_);
  std::swap(descriptor_, other.descriptor_);
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
    std::visit([&](auto number) { fmt::format_to(std::back_inserter(line), "{}", number); }, value);
  }
  append(line + '\n');
}

void CsvWriter::append(const std::string& line) {
  if (!error_.empty()) return;
  const ssize_t written = ::write(descriptor_, line.data(), line.size());
  if (written == static_cast<ssize_t>(line.size())) return;
  const int reason = written < 0 ? errno : ENOSPC;  // the system wrote what still fitted
  error_ = fmt::format("cannot write {}: {}", file_.string(), std::strerror(reason));
  if (written <= 0) return;
  const off_t end = ::lseek(descriptor_, 0, SEEK_END);
  if (end < 0 || ::ftruncate(descriptor_, end - written) != 0) error_ += "; its last line is incomplete";
}

}  // namespace cairn
