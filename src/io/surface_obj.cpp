// Wavefront OBJ: vertices and faces; materials, normals and textures are passed over.

#include <fmt/format.h>

#include <algorithm>

#include "shape_files.hpp"
#include "text_scanner.hpp"

namespace cairn::reading {
namespace {

constexpr std::string_view passed_over[] = {"vt", "vn", "vp", "usemtl", "mtllib", "s", "l", "p", "#"};
constexpr std::string_view words[] = {"v", "f", "o", "g", "vt", "vn", "usemtl", "mtllib", "s", "l", "p"};

/// The number of the vertex that a corner of a face names, from 0.
std::int32_t corner_of(const TextScanner& scanner, std::string_view text, std::size_t points) {
  std::int64_t index = 0;
  const std::string_view digits = text.substr(0, text.find('/'));
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
  if (end != digits.data() + digits.size() || status != std::errc{})
    scanner.fail(fmt::format("{} is not a corner of a face", in_quotes(text)));
  if (index < 0) index += static_cast<std::int64_t>(points) + 1;
  if (index < 1 || index > static_cast<std::int64_t>(points))
    scanner.fail(fmt::format("the face names vertex {}; {} are given before it", digits, points));
  return static_cast<std::int32_t>(index - 1);
}

/// The points that the triangles use, and no others.
void keep_used(const std::vector<Vec3>& points, SolidPart& part) {
  std::vector<std::int32_t> used;
  for (const auto& c : part.triangles.corners) used.insert(used.end(), c.begin(), c.end());
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (const auto i : used) part.triangles.points.push_back(points[i]);
  for (auto& c : part.triangles.corners)
    for (auto& corner : c) corner = static_cast<std::int32_t>(std::ranges::lower_bound(used, corner) - used.begin());
}

}  // namespace

std::vector<SolidPart> read_obj(std::string_view bytes) {
  TextScanner scanner(bytes);
  std::vector<Vec3> points;
  std::vector<SolidPart> parts;
  const auto part = [&]() -> SolidPart& {
    if (parts.empty()) parts.push_back({"", fmt::format("line {}", scanner.line()), {}});
    return parts.back();
  };
  while (scanner.next_line()) {
    const std::string_view word = scanner.word();
    if (word.empty() || word.starts_with('#') || std::ranges::find(passed_over, word) != std::end(passed_over))
      continue;
    if (word == "v") {
      const double x = scanner.number("x of a vertex"), y = scanner.number("y of a vertex");
      points.emplace_back(x, y, scanner.number("z of a vertex"));
    } else if (word == "f") {
      std::vector<std::int32_t> face;
      for (std::string_view corner = scanner.word(); !corner.empty(); corner = scanner.word())
        face.push_back(corner_of(scanner, corner, points.size()));
      if (face.size() < 3) scanner.fail(fmt::format("a face has {} corners; it needs at least 3", face.size()));
      for (std::size_t i = 2; i < face.size(); ++i) part().triangles.corners.push_back({face[0], face[i - 1], face[i]});
    } else if (word == "o" || word == "g") {
      parts.push_back({std::string(scanner.rest_of_line()), fmt::format("line {}", scanner.line()), {}});
    } else {
      scanner.fail(fmt::format("{} is no word of an OBJ file ({}), and the file is no STL or PLY either",
                               in_quotes(word), listed(words)));
    }
  }
  std::erase_if(parts, [](const SolidPart& p) { return p.triangles.corners.empty(); });
  for (SolidPart& one : parts) keep_used(points, one);
  return parts;
}

}  // namespace cairn::reading
