#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "cairn/io/agreement.hpp"
#include "cairn/io/table_file.hpp"
#include "table_writer.hpp"

namespace cairn {

namespace {

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

/// Writes the whole text under a temporary name and renames it; returns the error, empty if none.
std::string replace_text(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path temporary = temporary_name(file);
  errno = 0;
  std::FILE* stream = std::fopen(temporary.c_str(), "w");
  if (stream == nullptr) return write_failure(file, "creating the file", std::strerror(errno));
  const bool written = std::fwrite(text.data(), 1, text.size(), stream) == text.size();
  const bool closed = std::fclose(stream) == 0;
  std::string error = written && closed ? "" : write_failure(file, "writing", std::strerror(errno));
  if (error.empty()) error = publish(temporary, file);
  if (!error.empty()) std::remove(temporary.c_str());
  return error;
}

}  // namespace

void SeriesIndex::add(const std::string& name, double time, MPI_Comm comm) {
  entries_.push_back({name, time});
  write(comm);
}

void SeriesIndex::restore(std::vector<Entry> entries, MPI_Comm comm) {
  entries_ = std::move(entries);
  if (!entries_.empty()) write(comm);
}

void SeriesIndex::write(MPI_Comm comm) const {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  std::string error;
  if (rank == 0) {
    std::string text = "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n";
    for (const auto& entry : entries_)
      text += fmt::format("    {{\"name\": {}, \"time\": {}}}{}\n", quoted(entry.name), entry.time,
                          &entry == &entries_.back() ? "" : ",");
    error = replace_text(file_, text + "  ]\n}\n");
  }
  throw_together(comm, error);
}

}  // namespace cairn
