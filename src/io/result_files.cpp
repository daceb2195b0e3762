#include "cairn/io/result_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "cairn/core/error.hpp"

namespace cairn {
namespace {

namespace fs = std::filesystem;

struct Numbered {
  std::string_view start, ending;
};
constexpr Numbered numbered[] = {
    {"particles_", ".vtkhdf"}, {"grains_", ".h5"}, {"contacts_", ".h5"}, {"checkpoint_", ".h5"}};

bool is_number(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

bool is_result_name(const std::string& name) {
  if (name == "history.csv" || name == "bodies.csv" || name.ends_with(".hdf.series")) return true;
  return std::ranges::any_of(numbered, [&](const Numbered& n) {
    return name.size() > n.start.size() + n.ending.size() && name.starts_with(n.start) && name.ends_with(n.ending) &&
           is_number(std::string_view(name).substr(n.start.size(), name.size() - n.start.size() - n.ending.size()));
  });
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
      fs::remove(file, error);
      if (error) return fmt::format("cannot remove {}: {}", file.string(), error.message());
    }
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace cairn
