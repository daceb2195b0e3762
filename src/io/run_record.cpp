#include "cairn/io/run_record.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <map>
#include <utility>
#include <vector>

#include "cairn/io/program_facts.hpp"
#include "cairn/io/result_files.hpp"
#include "posix_file.hpp"

namespace cairn {
namespace {

constexpr std::string_view tail = "\n  ]\n}\n";

/// A string of JSON. Bytes that are no ASCII are kept where they may be UTF-8, as names and arguments are.
std::string json_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 32 ? fmt::format("\\u{:04x}", static_cast<unsigned>(c)) : std::string(1, c);
  }
  return out + "\"";
}

std::string now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::chrono::system_clock::now())); }

/// The machines and how many ranks each has, as JSON, on rank 0. Collective.
std::string hosts(MPI_Comm comm, int ranks) {
  std::array<char, MPI_MAX_PROCESSOR_NAME + 1> mine{};
  int length = 0;
  MPI_Get_processor_name(mine.data(), &length);
  std::vector<std::array<char, MPI_MAX_PROCESSOR_NAME + 1>> all(static_cast<std::size_t>(ranks));
  MPI_Gather(mine.data(), sizeof mine, MPI_BYTE, all.data(), sizeof mine, MPI_BYTE, 0, comm);
  std::map<std::string, int> counts;
  for (const auto& name : all) ++counts[name.data()];
  std::string text;
  for (const auto& [name, count] : counts)
    text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", json_string(name), count);
  return "{" + text + "}";
}

/// The entries of the runs before, as they are in the file.
std::string entries_of(const std::filesystem::path& file, std::string& error) {
  const PosixFile in(file, O_RDONLY | O_NOFOLLOW);
  if (!in.valid()) return {};
  std::string text(static_cast<std::size_t>(std::max<std::int64_t>(in.size(), 0)), '\0');
  const std::string_view mark = record_mark;
  if (in.read(text.data(), std::ssize(text), 0) && text.starts_with(mark) && text.ends_with(tail) &&
      text.size() >= mark.size() + tail.size())
    return text.substr(mark.size(), text.size() - mark.size() - tail.size());
  error = fmt::format("{}: is not as cairn left it, and this run cannot be added; move it away", file.string());
  return {};
}

}  // namespace

RunRecord::RunRecord(std::filesystem::path out, std::string command, MPI_Comm comm)
    : file_(std::move(out) / record_file), command_(std::move(command)) {
  MPI_Comm_size(comm, &ranks_);
  hosts_ = hosts(comm, ranks_);
}

std::string RunRecord::entry() const {
  const ProgramFacts& facts = program_facts();
  const std::pair<const char*, std::string> lines[] = {
      {"command", json_string(command_)},
      {"version", json_string(facts.version)},
      {"commit", json_string(facts.commit)},
      {"compiler", json_string(facts.compiler)},
      {"instruction_set", json_string(facts.instruction_set)},
      {"mpi", json_string(facts.mpi)},
      {"hdf5", json_string(facts.hdf5)},
      {"metis", json_string(facts.metis)},
      {"ranks", fmt::to_string(ranks_)},
      {"hosts", hosts_},
      {"first_step", fmt::to_string(step_)},
      {"start", json_string(start_)},
      {"end", end_.empty() ? "null" : json_string(end_)},
      {"exit_code", end_.empty() ? "null" : fmt::to_string(exit_code_)}};
  std::string text;
  for (const auto& [key, value] : lines)
    text += fmt::format("{}      \"{}\": {}", text.empty() ? "" : ",\n", key, value);
  return "    {\n" + text + "\n    }";
}

std::string RunRecord::begin(bool goes_on, std::int64_t step) {
  std::string error;
  if (goes_on) before_ = entries_of(file_, error);
  if (!error.empty()) return error;
  if (!before_.empty()) before_ += ",\n";
  step_ = step, start_ = now();
  return replace_file(file_, record_mark + before_ + entry() + std::string(tail));
}

std::string RunRecord::end(int exit_code) {
  if (step_ < 0) return {};
  end_ = now(), exit_code_ = exit_code;
  return replace_file(file_, record_mark + before_ + entry() + std::string(tail));
}

}  // namespace cairn
