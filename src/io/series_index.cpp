#include <fmt/format.h>

#include "cairn/io/agreement.hpp"
#include "cairn/io/result_files.hpp"
#include "cairn/io/table_file.hpp"

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
    error = replace_file(file_, text + "  ]\n}\n");
  }
  throw_together(comm, error);
}

}  // namespace cairn
