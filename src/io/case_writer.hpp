#pragma once
/// Lines of a case file in TOML.

#include <fmt/format.h>

#include <cmath>

#include "case_names.hpp"
#include "case_sections.hpp"

namespace cairn::reading {

/// The shortest text that reads back to the same bits, always as a TOML float.
inline std::string text_of(double value) {
  std::string text = fmt::format("{}", value);
  if (std::isfinite(value) && text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}
inline std::string text_of(bool value) { return value ? "true" : "false"; }
inline std::string text_of(std::int64_t value) { return std::to_string(value); }
inline std::string text_of(int value) { return std::to_string(value); }
inline std::string text_of(std::string_view value) {
  std::string text = "\"";
  for (const char c : value) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      text += {'\\', c};
    } else if (code < 32 || code == 127) {
      text += fmt::format("\\u{:04X}", code);
    } else {
      text += c;
    }
  }
  return text + '"';
}

/// [a, b, c] of the first `size` entries.
template <class List>
std::string list_of(const List& values, std::ptrdiff_t size) {
  std::string text = "[";
  for (std::ptrdiff_t i = 0; i < size; ++i) text += (i ? ", " : "") + text_of(values[i]);
  return text + "]";
}

inline std::string key_of(std::string_view name) {
  const auto bare = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-'; };
  return !name.empty() && std::ranges::all_of(name, bare) ? std::string(name) : text_of(name);
}

/// A case file under construction.
class Writer {
 public:
  explicit Writer(int dimension) : dim_(dimension) {}
  void section(std::string_view header) { text_ += fmt::format("\n{}\n", header); }
  template <class T>
  void key(std::string_view name, const T& value) {
    raw(name, text_of(value));
  }
  void raw(std::string_view name, std::string_view value) { text_ += fmt::format("{} = {}\n", name, value); }
  void vector(std::string_view name, const Vec3& v) { raw(name, list_of(v, dim_)); }
  void spin(const Vec3& w) { raw("angular_velocity", dim_ == 3 ? list_of(w, 3) : text_of(w.z())); }
  void motion(const Vec3& v, const Vec3& w) {
    vector("velocity", v);
    spin(w);
  }
  /// The `size` components from `first` on, a number where it is one; with rows of times or formulas where they change.
  static std::string table_of(const MotionTable& table, int first, int size) {
    std::string text;
    if (!table.formulas.empty()) {
      for (int k = first; k < first + size; ++k) text += (k > first ? ", " : "") + text_of(table.formulas[k].text());
      return size == 1 ? text : "[" + text + "]";
    }
    if (!table.varies()) {
      const Vec3 v = table.values.front();
      return size == 1 ? text_of(v[first]) : list_of(v, size);
    }
    for (std::size_t i = 0; i < table.times.size(); ++i) {
      text += fmt::format("{}[{}", i ? ", " : "", text_of(table.times[i]));
      for (int k = first; k < first + size; ++k) text += ", " + text_of(table.values[i][k]);
      text += "]";
    }
    return "[" + text + "]";
  }
  /// `along` is not given for walls. Nothing where there is no piston.
  std::string piston_of(const Piston& p, bool along) const {
    if (p.mass == 0) return {};
    std::string text = fmt::format("{} = {{ {} = {}", p.gain > 0 ? "servo" : "piston",
                                   p.pressure ? "pressure" : "force", table_of(p.force, 0, 1));
    if (p.force.repeat) text += ", repeat = true";
    if (p.area > 0) text += ", area = " + text_of(p.area);
    if (along) text += ", along = " + list_of(p.along, dim_);
    text += p.gain > 0 ? fmt::format(", gain = {}, largest = {}", text_of(p.gain), text_of(p.largest))
                       : fmt::format(", mass = {}, damping = {}", text_of(p.mass), text_of(p.damping));
    return text + " }";
  }
  std::string rotor_of(const Piston& r) const {
    return fmt::format("rotor = {{ inertia = {}, moment = {}{}, damping = {}{} }}", text_of(r.mass),
                       table_of(r.force, 0, 1), r.force.repeat ? ", repeat = true" : "", text_of(r.damping),
                       dim_ == 3 ? ", axis = " + list_of(r.along, 3) : "");
  }
  void drive(const Drive& d) {
    raw("velocity", table_of(d.velocity, 0, dim_));
    raw("angular_velocity", table_of(d.angular_velocity, dim_ == 3 ? 0 : 2, dim_ == 3 ? 3 : 1));
    if (d.velocity.repeat || d.angular_velocity.repeat) key("repeat", true);
    if (d.about) vector("about", *d.about);
    if (d.piston.mass > 0) text_ += piston_of(d.piston, true) + "\n";
    if (d.rotor.mass > 0) text_ += rotor_of(d.rotor) + "\n";
  }
  void face(std::string_view name, const Face& f) {
    std::string text = fmt::format("{{ type = \"{}\"", name_of(face_type_names, f.type));
    if (f.type == FaceType::fixed || f.type == FaceType::wall) text += ", velocity = " + table_of(f.velocity, 0, dim_);
    if (f.velocity.repeat) text += ", repeat = true";
    if (f.type == FaceType::free) text += fmt::format(", leaving = \"{}\"", name_of(leaving_names, f.leaving));
    if (f.type == FaceType::wall) text += ", friction = " + text_of(f.friction);
    if (f.position) text += ", position = " + text_of(*f.position);
    if (f.piston.mass > 0) text += ", " + piston_of(f.piston, false);
    raw(name, text + " }");
  }
  void axis(std::string_view name, const AxisDeformation& a) {
    const bool stress = a.by == AxisDeformation::By::stress;
    std::string text = fmt::format("{{ {} = {}", stress ? "stress" : "strain_rate", table_of(a.target, 0, 1));
    if (a.target.repeat) text += ", repeat = true";
    if (stress)
      text += fmt::format(", viscosity = {}, memory = {}, largest_rate = {}", text_of(a.viscosity), text_of(a.memory),
                          text_of(a.largest_rate));
    raw(name, text + " }");
  }
  void text(std::string_view lines) { text_ += lines; }
  std::string take() { return std::move(text_); }

 private:
  int dim_;
  std::string text_;
};

/// [[cracks]] and [crack].
void write_cracks(Writer& out, const Case& c);

}  // namespace cairn::reading
