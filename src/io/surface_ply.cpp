// PLY: as text, or binary of either order of bytes.

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "shape_files.hpp"
#include "text_scanner.hpp"

namespace cairn::reading {
namespace {

enum class Number { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
constexpr Named<Number> number_names[] = {
    {"char", Number::int8},   {"uchar", Number::uint8},   {"short", Number::int16},     {"ushort", Number::uint16},
    {"int", Number::int32},   {"uint", Number::uint32},   {"float", Number::float32},   {"double", Number::float64},
    {"int8", Number::int8},   {"uint8", Number::uint8},   {"int16", Number::int16},     {"uint16", Number::uint16},
    {"int32", Number::int32}, {"uint32", Number::uint32}, {"float32", Number::float32}, {"float64", Number::float64}};

struct Property {
  std::string name;
  Number type;
  bool is_list = false;
  Number count_type = Number::uint8;
};
struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Form { text, little, big };

struct Head {
  Form form = Form::text;
  std::vector<Element> elements;
  std::size_t bytes = 0;  // of the head
  std::int64_t lines = 0;
};

Number number_type(const TextScanner& scanner, std::string_view name) {
  for (const auto& known : number_names)
    if (known.name == name) return known.value;
  scanner.fail(fmt::format("{} is no type of numbers", in_quotes(name)));
}

Head read_head(std::string_view bytes) {
  constexpr std::string_view end = "end_header";
  Head head;
  const std::size_t found = bytes.find(end);
  const std::size_t line_end = found == bytes.npos ? found : bytes.find('\n', found);
  if (line_end == bytes.npos) throw InputError(": the head of the PLY file does not end; it is cut off");
  head.bytes = line_end + 1;
  TextScanner scanner(bytes.substr(0, found));
  scanner.next_line();
  while (scanner.next_line()) {
    const std::string_view word = scanner.word();
    if (word == "format") {
      const std::string_view form = scanner.word();
      if (form != "ascii" && form != "binary_little_endian" && form != "binary_big_endian")
        scanner.fail(fmt::format("the format {} is not known", in_quotes(form)));
      head.form = form == "ascii" ? Form::text : form == "binary_big_endian" ? Form::big : Form::little;
    } else if (word == "element") {
      Element element{std::string(scanner.word()), 0, {}};
      const double count = scanner.number("the number of an element");
      if (count < 0 || count > 2e9 || count != std::floor(count)) scanner.fail("is no number of elements");
      element.count = static_cast<std::uint64_t>(count);
      head.elements.push_back(element);
    } else if (word == "property") {
      if (head.elements.empty()) scanner.fail("a property comes before the first element");
      Property property;
      std::string_view type = scanner.word();
      if ((property.is_list = type == "list"))
        property.count_type = number_type(scanner, scanner.word()), type = scanner.word();
      property.type = number_type(scanner, type), property.name = scanner.word();
      head.elements.back().properties.push_back(property);
    } else if (!word.empty() && word != "comment" && word != "obj_info") {
      scanner.fail(fmt::format("{} is no word of the head of a PLY file", in_quotes(word)));
    }
  }
  head.lines = scanner.line() + (found > 0 && bytes[found - 1] == '\n' ? 1 : 0);
  return head;
}

/// The numbers behind the head, one after the other.
class Body {
 public:
  Body(std::string_view bytes, const Head& head)
      : form_(head.form), rest_(bytes.substr(head.bytes)), lines_(head.lines) {}

  double next(Number type) {
    if (form_ == Form::text) return next_word();
    switch (type) {
      case Number::int8:
        return next_as<std::int8_t>();
      case Number::uint8:
        return next_as<std::uint8_t>();
      case Number::int16:
        return next_as<std::int16_t>();
      case Number::uint16:
        return next_as<std::uint16_t>();
      case Number::int32:
        return next_as<std::int32_t>();
      case Number::uint32:
        return next_as<std::uint32_t>();
      case Number::float32:
        return next_as<float>();
      case Number::float64:
        return next_as<double>();
    }
    return 0;
  }
  [[noreturn]] void fail(const std::string& element, std::uint64_t number, std::string_view text) const {
    const std::string line = form_ == Form::text ? fmt::format(":{}", lines_) : "";
    throw InputError(fmt::format("{}: {} {}: {}", line, element, number, text));
  }
  void at(const std::string& element, std::uint64_t number) { element_ = &element, number_ = number; }

 private:
  template <class T>
  double next_as() {
    std::array<char, sizeof(T)> raw;
    if (rest_.size() < sizeof(T)) fail(*element_, number_, "the file ends before it; it is cut off");
    std::copy_n(rest_.begin(), sizeof(T), raw.begin());
    rest_.remove_prefix(sizeof(T));
    if (form_ == Form::big) std::ranges::reverse(raw);
    return static_cast<double>(std::bit_cast<T>(raw));
  }
  double next_word() {
    std::size_t first = 0;
    while (first < rest_.size() && std::isspace(static_cast<unsigned char>(rest_[first])))
      lines_ += rest_[first++] == '\n';
    rest_.remove_prefix(first);
    if (rest_.empty()) fail(*element_, number_, "the file ends before it; it is cut off");
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n"));
    rest_.remove_prefix(word.size());
    double value = 0;
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size() || status != std::errc{})
      fail(*element_, number_, in_quotes(word) + " is not a number");
    return value;
  }

  Form form_;
  std::string_view rest_;
  std::int64_t lines_;
  const std::string* element_ = nullptr;
  std::uint64_t number_ = 0;
};

void read_vertex(Body& body, const Element& element, std::uint64_t number, Triangles& triangles) {
  Vec3 x = Vec3::Zero();
  for (const Property& p : element.properties) {
    auto count = static_cast<std::uint64_t>(p.is_list ? std::max(0.0, body.next(p.count_type)) : 1);
    double value = 0;
    while (count-- > 0) value = body.next(p.type);
    if (p.name == "x") x.x() = value;
    if (p.name == "y") x.y() = value;
    if (p.name == "z") x.z() = value;
  }
  if (!x.allFinite()) body.fail(element.name, number, "has a coordinate that is no finite number");
  triangles.points.push_back(x);
}

void read_face(Body& body, const Element& element, std::uint64_t number, Triangles& triangles) {
  for (const Property& p : element.properties) {
    const double count = p.is_list ? body.next(p.count_type) : 1;
    const bool corners = p.is_list && (p.name == "vertex_indices" || p.name == "vertex_index");
    if (corners && !(count >= 3 && count < 1e6)) body.fail(element.name, number, fmt::format("has {} corners", count));
    std::vector<std::int32_t> face;
    for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(std::max(0.0, count)); ++i) {
      const double index = body.next(p.type);
      if (!corners) continue;
      if (!(index >= 0 && index < static_cast<double>(triangles.points.size())))
        body.fail(element.name, number, fmt::format("names vertex {}; there are {}", index, triangles.points.size()));
      face.push_back(static_cast<std::int32_t>(index));
    }
    for (std::size_t i = 2; i < face.size(); ++i) triangles.corners.push_back({face[0], face[i - 1], face[i]});
  }
}

}  // namespace

std::vector<SolidPart> read_ply(std::string_view bytes) {
  const Head head = read_head(bytes);
  Body body(bytes, head);
  SolidPart part{"", "the first face", {}};
  for (const Element& element : head.elements) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      body.at(element.name, i);
      if (element.properties.empty()) break;
      if (element.name == "vertex")
        read_vertex(body, element, i, part.triangles);
      else if (element.name == "face")
        read_face(body, element, i, part.triangles);
      else
        for (const Property& p : element.properties)
          for (auto n = static_cast<std::uint64_t>(p.is_list ? std::max(0.0, body.next(p.count_type)) : 1); n > 0; --n)
            body.next(p.type);
    }
  }
  return {part};
}

}  // namespace cairn::reading
