#include "shape_copies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <vector>

#include "cairn/io/checksum.hpp"

namespace cairn::reading {

std::string copy_name(const std::filesystem::path& file, std::uint64_t checksum) {
  std::string ending = file.extension().string();
  const auto plain = [](unsigned char c) { return std::isalnum(c) != 0; };
  if (ending.size() < 2 || ending.size() > 8 || !std::all_of(ending.begin() + 1, ending.end(), plain)) ending = ".dat";
  return fmt::format("{}{:016x}{}", shape_copy, checksum, ending);
}

bool checksum_of(const PosixFile& file, std::uint64_t& sum) {
  std::vector<char> buffer(std::size_t{1} << 20);
  Checksum all;
  for (std::int64_t at = 0, size = file.size(); at < size;) {
    const std::int64_t count = std::min(size - at, std::ssize(buffer));
    if (!file.read(buffer.data(), count, at)) return false;
    all.add_values(std::span<const char>(buffer.data(), static_cast<std::size_t>(count)));
    at += count;
  }
  sum = all.value();
  return true;
}

bool is_shape_copy(const std::string& name, const PosixFile& file) {
  std::uint64_t sum = 0;
  return checksum_of(file, sum) && name == copy_name(name, sum);
}

}  // namespace cairn::reading
