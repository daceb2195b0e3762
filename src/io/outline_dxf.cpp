// Closed lines of a DXF drawing (text): polylines, and lines, arcs and circles that join at their ends.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <numbers>

#include "shape_files.hpp"
#include "text_scanner.hpp"

namespace cairn::reading {
namespace {

constexpr int round_parts = 64;  // of a whole circle

using Line = std::vector<Vec3>;

struct Drawn {
  Line points;
  bool closed = false;
  std::int64_t at = 0;  // line of the file
};

Vec3 on_circle(const Vec3& centre, double radius, double angle) {
  return centre + radius * Vec3(std::cos(angle), std::sin(angle), 0);
}

/// Appends an arc's points but for the first.
void add_arc(Line& line, const Vec3& centre, double radius, double from, double sweep) {
  const int parts = std::max(1, static_cast<int>(std::ceil(std::abs(sweep) / (2 * std::numbers::pi) * round_parts)));
  for (int i = 1; i <= parts; ++i) line.push_back(on_circle(centre, radius, from + sweep * i / parts));
}

/// From the last point to the next on an arc whose quarter angle has this tangent.
void add_bulge(Line& line, const Vec3& to, double bulge) {
  const Vec3 from = line.back(), way = to - from;
  if (bulge == 0 || way.norm() == 0) return line.push_back(to);
  const double sweep = 4 * std::atan(bulge);
  const Vec3 left(-way.y(), way.x(), 0);
  const Vec3 centre = 0.5 * (from + to) + left * (1 - bulge * bulge) / (4 * bulge);
  const Vec3 d = from - centre;
  add_arc(line, centre, d.norm(), std::atan2(d.y(), d.x()), sweep);
  line.back() = to;
}

class Drawing {
 public:
  explicit Drawing(std::string_view text) : scanner_(text) {}

  std::vector<Drawn> read() {
    bool inside = false;
    next();
    while (!ended_) {
      if (code_ != 0) {
        next();
        continue;
      }
      const std::string kind(value_);
      at_ = scanner_.line();
      next();
      if (kind == "SECTION" && code_ == 2) inside = value_ == "ENTITIES";
      if (kind == "ENDSEC") inside = false;
      if (inside && kind != "SECTION") entity(kind);
    }
    return std::move(drawn_);
  }

 private:
  void next() {
    if (!scanner_.next_line()) {
      ended_ = true;
      return;
    }
    const std::string_view code = scanner_.rest_of_line();
    const auto [end, status] = std::from_chars(code.data(), code.data() + code.size(), code_);
    if (end != code.data() + code.size() || status != std::errc{})
      scanner_.fail(fmt::format("{} is no group code; the lines of a DXF file come in pairs", in_quotes(code)));
    if (!scanner_.next_line()) scanner_.fail("the file ends in the middle of a pair of lines; it is cut off");
    value_ = scanner_.rest_of_line();
  }
  double value() const { return scanner_.number_of(value_, "a number"); }

  struct Corner {
    Vec3 at = Vec3::Zero();
    double bulge = 0;
  };

  void entity(const std::string& kind) {
    if (kind == "LWPOLYLINE") return polyline(true);
    if (kind == "POLYLINE") return polyline(false);
    if (kind == "LINE" || kind == "ARC" || kind == "CIRCLE") return simple(kind);
    constexpr std::string_view shapes[] = {"SPLINE", "ELLIPSE", "INSERT", "HATCH", "SOLID", "3DFACE"};
    if (std::ranges::find(shapes, kind) != std::end(shapes))
      scanner_.fail(fmt::format("{} is not read; turn it into polylines, lines and arcs ('explode')", kind));
  }

  void polyline(bool light) {
    std::vector<Corner> corners;
    const std::int64_t at = at_;
    bool closed = false, vertices = light;
    while (!ended_) {
      if (code_ == 0 && (light || (value_ != "VERTEX" && value_ != "SEQEND"))) break;
      if (code_ == 0 && value_ == "SEQEND") {
        next();
        break;
      }
      if (code_ == 0) corners.emplace_back(), vertices = true;
      if (code_ == 10 && light) corners.emplace_back();
      if (code_ == 70 && (light || !vertices)) closed = static_cast<int>(value()) & 1;
      if (vertices && !corners.empty()) {
        if (code_ == 10) corners.back().at.x() = value();
        if (code_ == 20) corners.back().at.y() = value();
        if (code_ == 42) corners.back().bulge = value();
      }
      next();
    }
    if (corners.empty()) return;
    Drawn drawn{{corners[0].at}, closed, at};
    for (std::size_t i = 1; i < corners.size(); ++i) add_bulge(drawn.points, corners[i].at, corners[i - 1].bulge);
    if (closed) add_bulge(drawn.points, corners[0].at, corners.back().bulge);
    drawn_.push_back(std::move(drawn));
  }

  void simple(const std::string& kind) {
    std::array<double, 60> v{};
    const std::int64_t at = at_;
    for (; !ended_ && code_ != 0; next())
      if (code_ >= 10 && code_ < 60) v[code_] = value();
    const Vec3 first(v[10], v[20], 0);
    constexpr double degree = std::numbers::pi / 180;
    Drawn drawn{{first}, kind == "CIRCLE", at};
    if (kind == "LINE") {
      drawn.points.emplace_back(v[11], v[21], 0.0);
    } else {
      const double from = kind == "CIRCLE" ? 0 : v[50] * degree;
      double sweep = kind == "CIRCLE" ? 360 * degree : (v[51] - v[50]) * degree;
      if (sweep <= 0) sweep += 360 * degree;
      drawn.points = {on_circle(first, v[40], from)};
      add_arc(drawn.points, first, v[40], from, sweep);
    }
    drawn_.push_back(std::move(drawn));
  }

  TextScanner scanner_;
  int code_ = -1;
  std::string_view value_;
  bool ended_ = false;
  std::int64_t at_ = 0;
  std::vector<Drawn> drawn_;
};

}  // namespace

std::vector<LinePart> read_dxf_lines(std::string_view bytes) {
  std::vector<Drawn> open = Drawing(bytes).read();
  std::vector<LinePart> lines;
  Bounds all = shapes::nothing();
  for (const Drawn& d : open)
    for (const Vec3& p : d.points) shapes::widen(all, p);
  const double near = open.empty() ? 0 : 1e-6 * (all.upper - all.lower).norm();
  const auto same = [&](const Vec3& a, const Vec3& b) { return (a - b).norm() <= near; };
  while (!open.empty()) {
    Drawn d = std::move(open.front());
    open.erase(open.begin());
    const auto joins = [&](const Drawn& o) {
      return !o.closed && (same(o.points.front(), d.points.back()) || same(o.points.back(), d.points.back()));
    };
    while (!d.closed && !same(d.points.front(), d.points.back())) {
      const auto next = std::ranges::find_if(open, joins);
      if (next == open.end())
        throw InputError(fmt::format(":{}: the line that begins here ends at [{}, {}], where nothing goes on; close it",
                                     d.at, d.points.back().x(), d.points.back().y()));
      if (!same(next->points.front(), d.points.back())) std::ranges::reverse(next->points);
      d.points.insert(d.points.end(), next->points.begin() + 1, next->points.end());
      open.erase(next);
    }
    if (d.points.size() > 1 && same(d.points.front(), d.points.back())) d.points.pop_back();
    lines.push_back({fmt::format("line {}", d.at), std::move(d.points)});
  }
  return lines;
}

}  // namespace cairn::reading
