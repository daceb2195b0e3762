// STL: binary, or as text.

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "shape_files.hpp"
#include "text_scanner.hpp"

namespace cairn::reading {
namespace {

std::string lower_case(std::string_view word) {
  std::string text(word);
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// Takes the words of a file of facets one after the other, over the ends of lines.
class FacetReader {
 public:
  explicit FacetReader(std::string_view bytes) : scanner_(bytes) {}

  std::vector<SolidPart> read() {
    std::vector<SolidPart> parts;
    while (true) {
      const std::string word = next(true);
      if (word.empty()) break;
      if (word == "solid") {
        parts.push_back({std::string(scanner_.rest_of_line()), fmt::format("line {}", scanner_.line()), {}});
        scanner_.skip_line();
        read_facets(parts.back());
      } else {
        scanner_.fail(fmt::format("{} where a solid was expected", in_quotes(word)));
      }
    }
    return parts;
  }

 private:
  std::string next(bool may_end = false) {
    std::string_view word = scanner_.word();
    while (word.empty()) {
      if (!scanner_.next_line()) {
        if (may_end) return {};
        scanner_.fail("the file ends in the middle of a solid; it is cut off");
      }
      word = scanner_.word();
    }
    return lower_case(word);
  }
  void expect(std::string_view word) {
    if (const std::string found = next(); found != word)
      scanner_.fail(fmt::format("{} where '{}' was expected", in_quotes(found), word));
  }
  double number() { return scanner_.number_of(next(), "a coordinate"); }

  void read_facets(SolidPart& part) {
    while (true) {
      const std::string word = next();
      if (word == "endsolid") {
        scanner_.skip_line();
        return;
      }
      if (word != "facet") scanner_.fail(fmt::format("{} where 'facet' or 'endsolid' was expected", in_quotes(word)));
      expect("normal");
      for (int k = 0; k < 3; ++k) next();  // follows from the corners, and is often wrong or nan
      expect("outer"), expect("loop");
      const auto first = static_cast<std::int32_t>(part.triangles.points.size());
      for (int corner = 0; corner < 3; ++corner) {
        expect("vertex");
        const double x = number(), y = number(), z = number();
        part.triangles.points.emplace_back(x, y, z);
      }
      expect("endloop"), expect("endfacet");
      part.triangles.corners.push_back({first, first + 1, first + 2});
    }
  }

  TextScanner scanner_;
};

}  // namespace

std::vector<SolidPart> read_ascii_stl(std::string_view bytes) { return FacetReader(bytes).read(); }

std::vector<SolidPart> read_binary_stl(std::string_view bytes) {
  static_assert(std::endian::native == std::endian::little);
  constexpr std::size_t head = 84, facet = 50;
  SolidPart part{"", "facet 0", {}};
  const std::size_t count = (bytes.size() - head) / facet;
  part.triangles.points.reserve(3 * count), part.triangles.corners.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    float numbers[12];
    std::memcpy(numbers, bytes.data() + head + i * facet, sizeof numbers);
    const auto first = static_cast<std::int32_t>(part.triangles.points.size());
    for (int corner = 0; corner < 3; ++corner) {
      const float* x = numbers + 3 + 3 * corner;  // behind the normal
      if (!std::isfinite(x[0]) || !std::isfinite(x[1]) || !std::isfinite(x[2]))
        throw InputError(
            fmt::format(": facet {} (byte {}) has a corner that is no finite number", i, head + i * facet));
      part.triangles.points.emplace_back(x[0], x[1], x[2]);
    }
    part.triangles.corners.push_back({first, first + 1, first + 2});
  }
  return {part};
}

std::vector<SolidPart> read_solids(std::string_view bytes) {
  constexpr std::size_t head = 84, facet = 50, most = 500'000'000;
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return read_ply(bytes);
  std::uint32_t count = 0;
  if (bytes.size() >= head) std::memcpy(&count, bytes.data() + 80, sizeof count);
  // Many binary files begin with "solid" too: the size tells.
  if (bytes.size() >= head && bytes.size() == head + facet * std::size_t{count}) {
    if (count > most) throw InputError(fmt::format(": holds {} facets; at most {} can be read", count, most));
    return read_binary_stl(bytes);
  }
  const std::string_view text = without_mark(bytes);
  const std::size_t first = std::min(text.find_first_not_of(" \t\r\n"), text.size());
  if (text.find('\0') != text.npos) {
    throw InputError(
        fmt::format(": is no file that is known (STL, PLY, OBJ); a binary STL with the {} facets that its "
                    "head names has {} bytes, this file has {}{}",
                    count, head + facet * std::size_t{count}, bytes.size(),
                    bytes.size() < head + facet * std::size_t{count} ? ": it is cut off" : ""));
  }
  return lower_case(text.substr(first, 5)) == "solid" ? read_ascii_stl(text) : read_obj(text);
}

}  // namespace cairn::reading
