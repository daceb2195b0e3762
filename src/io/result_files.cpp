#include "cairn/io/result_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "cairn/core/error.hpp"
#include "cairn/io/own_files.hpp"
#include "table_writer.hpp"

namespace cairn {
namespace {

namespace fs = std::filesystem;

struct Numbered {
  std::string_view start, ending;
};
constexpr Numbered numbered[] = {{"particles_", ".vtkhdf"}, {"grains_", ".h5"}, {"contacts_", ".h5"},
                                 {"cracks_", ".h5"},        {"tips_", ".h5"},   {"checkpoint_", ".h5"}};

bool is_number(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

bool is_result_name(const std::string& name) {
  for (const char* one :
       {"history.csv", "bodies.csv", "forces.csv", "tips.csv", "particles.hdf.series", failure_file, record_file})
    if (name == one) return true;
  return std::ranges::any_of(numbered, [&](const Numbered& n) {
    return name.size() > n.start.size() + n.ending.size() && name.starts_with(n.start) && name.ends_with(n.ending) &&
           is_number(std::string_view(name).substr(n.start.size(), name.size() - n.start.size() - n.ending.size()));
  });
}

std::vector<NumberedFile> numbered_files(const fs::path& folder, const std::string& kind) {
  std::vector<NumberedFile> found;
  const std::string start = kind + "_";
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(start) || !is_result_name(name) || name.size() > start.size() + 24) continue;
    found.push_back({std::strtoll(name.c_str() + start.size(), nullptr, 10), entry->path()});
  }
  std::ranges::sort(found, {}, &NumberedFile::number);
  return found;
}

std::string numbered_name(const std::string& kind, std::int64_t number) {
  for (const auto& n : numbered)
    if (n.start == kind + "_") return fmt::format("{}{:06}{}", n.start, number, n.ending);
  throw std::logic_error("no numbered files of kind " + kind);
}

void remove_leftovers(const fs::path& folder) {
  constexpr std::string_view ending = ".part";
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with('.') && name.ends_with(ending) &&
        is_result_name(name.substr(1, name.size() - 1 - ending.size())))
      found.push_back(entry->path());
  }
  for (const auto& file : found) fs::remove(file, error);
}

UnflushedFiles::~UnflushedFiles() {
  try {
    flush();
  } catch (const std::exception&) {  // no memory: what is being reported already matters more
  }
}

std::string UnflushedFiles::flush() {
  std::string first;
  for (const auto& file : files_) {
    const std::string error = flush_to_disk(file);
    if (first.empty()) first = error;
  }
  files_.clear();
  return first;
}

std::string replace_file(const fs::path& file, const std::string& text) {
  const fs::path temporary = temporary_name(file);
  PosixFile out = create_temporary(temporary);
  if (!out.valid()) return write_failure(file, "creating the file", std::strerror(errno));
  const bool good = out.write(text.data(), std::ssize(text), 0) && out.close();
  std::string error = good ? "" : write_failure(file, "writing", std::strerror(errno));
  if (error.empty()) error = publish(temporary, file);
  if (!error.empty()) ::unlink(temporary.c_str());
  return error;
}

std::vector<fs::path> find_results(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  if (!fs::is_directory(folder, error)) return found;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code ignored;
    if (is_result_name(entry->path().filename().string()) && !entry->is_directory(ignored))
      found.push_back(entry->path());
  }
  if (error) throw InputError(fmt::format("{}: the folder cannot be read: {}", folder.string(), error.message()));
  std::ranges::sort(found);
  return found;
}

std::string remove_results(const fs::path& folder) {
  try {
    for (const auto& file : find_results(folder)) {
      std::error_code error;
      if (const std::string reason = foreign_result(file); !reason.empty()) return reason;
      fs::remove(file, error);
      if (error) return fmt::format("cannot remove {}: {}", file.string(), error.message());
    }
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace cairn
