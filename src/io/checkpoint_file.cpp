#include "cairn/io/checkpoint_file.hpp"

#include <fmt/format.h>

#include "cairn/core/error.hpp"
#include "cairn/io/agreement.hpp"
#include "seal.hpp"
#include "table_writer.hpp"

namespace cairn {

namespace {

constexpr const char* checkpoint_kind = "checkpoint";
constexpr std::int64_t format_version = 6;

}  // namespace

struct CheckpointWriter::State {
  TableWriter writer;
  MPI_Comm comm;
};

CheckpointWriter::CheckpointWriter(std::filesystem::path file, MPI_Comm comm, std::int64_t bytes, std::int64_t rows,
                                   double time, std::int64_t step)
    : state_(new State{{std::move(file), comm, bytes}, comm}) {
  state_->writer.add_attribute("/", "kind", std::string(checkpoint_kind));
  state_->writer.add_program();
  add("format", format_version);
  add("rows", rows);
  add("time", time);
  add("step", step);
}

CheckpointWriter::~CheckpointWriter() = default;

void CheckpointWriter::add(const std::string& name, double value) { state_->writer.add_attribute("/", name, value); }
void CheckpointWriter::add(const std::string& name, std::int64_t value) {
  state_->writer.add_attribute("/", name, value);
}

void CheckpointWriter::add_text(const std::string& name, const std::string& text) {
  int rank = 0;
  MPI_Comm_rank(state_->comm, &rank);
  auto size = static_cast<std::int64_t>(text.size());
  MPI_Bcast(&size, 1, MPI_INT64_T, 0, state_->comm);
  RowBlocks rows{{}, size};
  if (rank == 0 && size > 0) rows.blocks.push_back({0, size});
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  state_->writer.write(name, 1, rows, std::span(bytes, rank == 0 ? text.size() : 0));
}

void CheckpointWriter::write(const Column& column, const RowBlocks& rows) {
  std::visit([&](auto values) { state_->writer.write(column.name, column.components, rows, values); }, column.values);
}

void CheckpointWriter::finish() { state_->writer.finish(true); }

CheckpointReader::CheckpointReader(const std::filesystem::path& file, MPI_Comm comm) : file_(file), comm_(comm) {
  require(check_seal(file, comm));
  table_ = std::make_unique<TableReader>(file, comm);
  std::int64_t version = 0;
  const bool known = table_->kind() == checkpoint_kind && table_->attribute("format", version);
  require(known ? "" : "not a checkpoint of cairn");
  require(version == format_version
              ? ""
              : fmt::format("a checkpoint of format {}; this version reads format {}", version, format_version));
}

void CheckpointReader::require(const std::string& problem) const {
  const std::string message =
      common_error(comm_, problem.empty() ? "" : fmt::format("{}: {}", file_.string(), problem));
  if (!message.empty()) throw InputError(message);
}

std::int64_t CheckpointReader::rows_of(const std::string& column) const {
  const std::int64_t rows = table_->rows_of(column);
  require(rows >= 0 ? "" : fmt::format("it lacks the column {}, or that has more rows than the file holds", column));
  return rows;
}

void CheckpointReader::read(const std::string& name, double& value) const {
  require(table_->attribute(name, value) ? "" : "it lacks the number " + name);
}
void CheckpointReader::read(const std::string& name, std::int64_t& value) const {
  require(table_->attribute(name, value) ? "" : "it lacks the number " + name);
}

std::string CheckpointReader::text(const std::string& name) const {
  const auto bytes = column<std::uint8_t>(name);
  return {bytes.begin(), bytes.end()};
}

}  // namespace cairn
