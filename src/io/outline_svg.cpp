// Closed lines of an SVG drawing: paths, polygons, rectangles, circles and ellipses, with the transforms of what they
// lie in. y points up: it is minus that of the drawing.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "cairn/core/error.hpp"
#include "shape_files.hpp"

namespace cairn::reading {
namespace {

using Line = std::vector<Vec3>;
using Map = Eigen::Affine2d;
constexpr int curve_parts = 24, round_parts = 64;

struct Text {
  std::string_view text;
  [[noreturn]] void fail(const char* at, std::string_view message) const {
    throw InputError(fmt::format(":{}: {}", 1 + std::count(text.data(), at, '\n'), message));
  }
};

/// Numbers and letters of an attribute.
class Numbers {
 public:
  Numbers(const Text& place, std::string_view text) : place_(place), rest_(text) {}
  bool ended() {
    skip();
    return rest_.empty();
  }
  bool at_letter() { return !ended() && std::isalpha(static_cast<unsigned char>(rest_[0])); }
  char letter() {
    const char c = rest_[0];
    rest_.remove_prefix(1);
    return c;
  }
  double next() {
    skip();
    std::string_view digits = rest_;
    if (digits.starts_with('+')) digits.remove_prefix(1);
    double value = 0;
    const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (status != std::errc{} || !std::isfinite(value)) fail("a number is missing or is none");
    rest_ = digits.substr(static_cast<std::size_t>(end - digits.data()));
    return value;
  }
  /// A flag of an arc, which needs nothing between it and the next.
  bool flag() {
    skip();
    if (rest_.empty() || (rest_[0] != '0' && rest_[0] != '1')) fail("a flag of an arc must be 0 or 1");
    return letter() == '1';
  }
  [[noreturn]] void fail(std::string_view message) const { place_.fail(rest_.data(), message); }

 private:
  void skip() {
    while (!rest_.empty() && (std::isspace(static_cast<unsigned char>(rest_[0])) || rest_[0] == ','))
      rest_.remove_prefix(1);
  }
  Text place_;
  std::string_view rest_;
};

/// An elliptical arc by its ends (SVG 1.1, appendix F.6.5).
void add_arc(Line& line, double rx, double ry, double turn, bool large, bool sweep, const Vec3& to) {
  const Vec3 from = line.back();
  rx = std::abs(rx), ry = std::abs(ry);
  if (rx == 0 || ry == 0 || from == to) return line.push_back(to);
  const double cs = std::cos(turn), sn = std::sin(turn);
  const Vec3 h = 0.5 * (from - to);
  const double x = cs * h.x() + sn * h.y(), y = cs * h.y() - sn * h.x();
  const double grow = std::sqrt(x * x / (rx * rx) + y * y / (ry * ry));
  if (grow > 1) rx *= grow, ry *= grow;
  const double under = rx * rx * y * y + ry * ry * x * x;
  const double f = (large == sweep ? -1 : 1) * std::sqrt(std::max(0.0, rx * rx * ry * ry / under - 1));
  const double cx = f * rx * y / ry, cy = -f * ry * x / rx;
  const double a = std::atan2((y - cy) / ry, (x - cx) / rx);
  double d = std::atan2((-y - cy) / ry, (-x - cx) / rx) - a;
  if (sweep && d < 0) d += 2 * std::numbers::pi;
  if (!sweep && d > 0) d -= 2 * std::numbers::pi;
  const Vec3 middle = 0.5 * (from + to) + Vec3(cs * cx - sn * cy, sn * cx + cs * cy, 0);
  for (int i = 1; i < round_parts; ++i) {
    const double px = rx * std::cos(a + d * i / round_parts), py = ry * std::sin(a + d * i / round_parts);
    line.push_back(middle + Vec3(cs * px - sn * py, sn * px + cs * py, 0));
  }
  line.push_back(to);
}

/// A Bézier curve through `points` (de Casteljau), but for the first, which the line has.
void add_curve(Line& line, const std::vector<Vec3>& points) {
  for (int i = 1; i <= curve_parts; ++i) {
    std::vector<Vec3> p = points;
    const double t = static_cast<double>(i) / curve_parts;
    for (std::size_t n = p.size() - 1; n > 0; --n)
      for (std::size_t k = 0; k < n; ++k) p[k] = (1 - t) * p[k] + t * p[k + 1];
    line.push_back(p[0]);
  }
}

class Path {
 public:
  Path(const Text& place, std::string_view text) : numbers_(place, text) {}

  std::vector<Line> read() {
    while (!numbers_.ended()) {
      if (numbers_.at_letter())
        command_ = numbers_.letter();
      else if (command_ == 'M' || command_ == 'm')
        command_ = command_ == 'M' ? 'L' : 'l';
      else if (command_ == 0 || command_ == 'Z' || command_ == 'z')
        numbers_.fail("a path must go on with a command");
      step();
    }
    if (!line_.empty()) end(false);
    return std::move(lines_);
  }

 private:
  void end(bool closed) {
    const double near = 1e-9 * (1 + line_.front().norm());
    if (!closed && line_.size() > 1 && (line_.front() - line_.back()).norm() > near)
      numbers_.fail("a path is not closed; end it with Z");
    start_ = line_.front();
    if (line_.size() > 2) lines_.push_back(line_);
    line_.clear();
  }
  Vec3 point(bool relative) {
    const double x = numbers_.next(), y = numbers_.next();
    return (relative && !line_.empty() ? line_.back() : relative ? start_ : Vec3::Zero().eval()) + Vec3(x, y, 0);
  }
  /// What a smooth curve begins with: the last control point on the other side.
  Vec3 reflected(std::string_view after) const {
    return after.find(static_cast<char>(std::toupper(last_))) != after.npos ? (2 * line_.back() - control_).eval()
                                                                            : line_.back();
  }

  void step() {
    const bool relative = std::islower(static_cast<unsigned char>(command_));
    const char kind = static_cast<char>(std::toupper(command_));
    if (kind == 'Z') {
      if (!line_.empty()) end(true);
    } else if (kind == 'M') {
      const Vec3 to = point(relative);
      if (!line_.empty()) end(false);
      line_ = {to};
    } else {
      if (line_.empty()) line_ = {start_};
      draw(kind, relative);
    }
    last_ = command_;
  }

  void draw(char kind, bool relative) {
    std::vector<Vec3> curve = {line_.back()};
    switch (kind) {
      case 'L':
        line_.push_back(point(relative));
        break;
      case 'H':
        line_.emplace_back((relative ? curve[0].x() : 0) + numbers_.next(), curve[0].y(), 0.0);
        break;
      case 'V':
        line_.emplace_back(curve[0].x(), (relative ? curve[0].y() : 0) + numbers_.next(), 0.0);
        break;
      case 'C':
      case 'S':
      case 'Q':
      case 'T': {
        if (kind == 'S') curve.push_back(reflected("CS"));
        if (kind == 'T') curve.push_back(reflected("QT"));
        for (int more = kind == 'C' ? 3 : kind == 'T' ? 1 : 2; more > 0; --more) curve.push_back(point(relative));
        add_curve(line_, curve);
        control_ = curve[curve.size() - 2];
        break;
      }
      case 'A': {
        const double rx = numbers_.next(), ry = numbers_.next(), turn = numbers_.next() * std::numbers::pi / 180;
        const bool large = numbers_.flag(), sweep = numbers_.flag();
        add_arc(line_, rx, ry, turn, large, sweep, point(relative));
        break;
      }
      default:
        numbers_.fail(fmt::format("'{}' is no command of a path", command_));
    }
  }

  Numbers numbers_;
  char command_ = 0, last_ = 0;
  Vec3 start_ = Vec3::Zero(), control_ = Vec3::Zero();
  Line line_;
  std::vector<Line> lines_;
};

/// A tag with its attributes.
struct Tag {
  Text place;
  std::string_view name, text;

  std::string_view attribute(std::string_view key) const {
    for (std::size_t at = text.find(key); at != text.npos; at = text.find(key, at + 1)) {
      std::size_t i = at + key.size();
      if (at > 0 && !std::isspace(static_cast<unsigned char>(text[at - 1]))) continue;
      while (i < text.size() && std::isspace(static_cast<unsigned char>(text[i]))) ++i;
      if (i >= text.size() || text[i] != '=') continue;
      const std::size_t open = text.find_first_of("\"'", i);
      if (open == text.npos) break;
      return text.substr(open + 1, text.find(text[open], open + 1) - open - 1);
    }
    return {};
  }
  double number(std::string_view key) const {
    const std::string_view value = attribute(key);
    return value.empty() ? 0.0 : Numbers(place, value).next();
  }
};

Map transform_of(const Tag& tag) {
  Map all = Map::Identity();
  std::string_view text = tag.attribute("transform");
  while (true) {
    const std::size_t open = text.find('('), close = text.find(')');
    if (open == text.npos || close == text.npos || close < open) return all;
    const std::size_t first = text.find_first_not_of(" ,\t\r\n");
    const std::string_view name = text.substr(first, text.find_last_not_of(" \t", open - 1) - first + 1);
    Numbers numbers(tag.place, text.substr(open + 1, close - open - 1));
    std::vector<double> v;
    while (!numbers.ended()) v.push_back(numbers.next());
    const std::size_t given = v.size();
    v.resize(6, 0.0);
    if (name == "translate") {
      all.translate(Eigen::Vector2d(v[0], v[1]));
    } else if (name == "scale") {
      all.scale(Eigen::Vector2d(v[0], given > 1 ? v[1] : v[0]));
    } else if (name == "rotate") {
      all.translate(Eigen::Vector2d(v[1], v[2]))
          .rotate(v[0] * std::numbers::pi / 180)
          .translate(Eigen::Vector2d(-v[1], -v[2]));
    } else if (name == "matrix" && given == 6) {
      Map m = Map::Identity();
      m.matrix() << v[0], v[2], v[4], v[1], v[3], v[5], 0, 0, 1;
      all = all * m;
    } else {
      tag.place.fail(text.data(), fmt::format("the transform {} is not read", in_quotes(name)));
    }
    text.remove_prefix(close + 1);
  }
}

/// Elements whose contents are not drawn where they stand.
bool only_defines(const Tag& tag) {
  static constexpr std::array names = {"defs", "clipPath", "mask", "symbol", "pattern", "marker"};
  return std::ranges::find(names, tag.name) != names.end();
}

std::vector<Line> lines_of(const Tag& tag) {
  if (tag.name == "use") tag.place.fail(tag.text.data(), "<use> is not read; make a path of what it draws");
  if (tag.name == "path") return Path(tag.place, tag.attribute("d")).read();
  Line line;
  if (tag.name == "polygon" || tag.name == "polyline") {
    Numbers numbers(tag.place, tag.attribute("points"));
    while (!numbers.ended()) {
      const double x = numbers.next();
      line.emplace_back(x, numbers.next(), 0.0);
    }
  } else if (tag.name == "rect") {
    const double x = tag.number("x"), y = tag.number("y"), w = tag.number("width"), h = tag.number("height");
    line = {{x, y, 0}, {x + w, y, 0}, {x + w, y + h, 0}, {x, y + h, 0}};
  } else if (tag.name == "circle" || tag.name == "ellipse") {
    const bool circle = tag.name == "circle";
    const double rx = tag.number(circle ? "r" : "rx"), ry = tag.number(circle ? "r" : "ry");
    for (int i = 0; i < round_parts; ++i) {
      const double a = 2 * std::numbers::pi * i / round_parts;
      line.emplace_back(tag.number("cx") + rx * std::cos(a), tag.number("cy") + ry * std::sin(a), 0.0);
    }
  }
  return line.empty() ? std::vector<Line>{} : std::vector<Line>{line};
}

}  // namespace

std::vector<LinePart> read_svg_lines(std::string_view bytes) {
  const Text place{bytes};
  std::vector<LinePart> all;
  std::vector<Map> maps = {Map::Identity()};
  std::size_t hidden = 0;  // depth of an element whose contents are not drawn; 0: none
  bool drawing = false;
  for (std::size_t at = bytes.find('<'); at != bytes.npos; at = bytes.find('<', at)) {
    const bool comment = bytes.substr(at).starts_with("<!--");
    const std::size_t end = comment ? bytes.find("-->", at) : bytes.find('>', at);
    if (end == bytes.npos) place.fail(bytes.data() + at, "the file ends within a tag; it is cut off");
    std::string_view text = bytes.substr(at + 1, end - at - 1);
    at = end;
    if (comment || text.starts_with('?') || text.starts_with('!')) continue;
    if (text.starts_with('/')) {
      if (maps.size() > 1) maps.pop_back();
      if (maps.size() <= hidden) hidden = 0;
      continue;
    }
    const bool alone = text.ends_with('/');
    if (alone) text.remove_suffix(1);
    const Tag tag{place, text.substr(0, text.find_first_of(" \t\r\n")), text};
    drawing = drawing || tag.name == "svg";
    if (hidden > 0 || only_defines(tag)) {
      if (hidden == 0 && !alone) hidden = maps.size();
      if (!alone) maps.push_back(maps.back());
      continue;
    }
    const Map map = maps.back() * transform_of(tag);
    for (Line& line : lines_of(tag)) {
      for (Vec3& p : line) {
        const Eigen::Vector2d mapped = map * p.head<2>().eval();
        p = Vec3(mapped.x(), -mapped.y(), 0);
      }
      all.push_back({std::string(tag.attribute("id")), std::move(line)});
    }
    if (!alone) maps.push_back(map);
  }
  if (!drawing) throw InputError(":1: is no SVG drawing: it holds no tag <svg>");
  return all;
}

}  // namespace cairn::reading
