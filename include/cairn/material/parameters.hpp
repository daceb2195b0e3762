#pragma once
/// What a law says about its parameters, so that reading, checking and documenting them needs no code for each law.

#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace cairn {

struct Parameter {
  std::string_view key, unit, meaning;
  double lower = 0;            // least value allowed ...
  bool lower_allowed = false;  // ... itself allowed or not
  double upper = std::numeric_limits<double>::infinity();
  std::optional<double> fallback = std::nullopt;  // the default; without one the key is required
  int most = 0;                                   // above 0: a list of 1 to so many numbers
  std::string_view as_many_as = {};               // the list before this one that has as many entries
};

/// Key of an entry of a list among the values.
inline std::string list_key(std::string_view key, std::ptrdiff_t entry) {
  return std::string(key) + '.' + std::to_string(entry);
}

struct LawInfo {
  std::string_view name;
  std::span<const Parameter> parameters;
  bool has_plane_stress, has_pressure;
};

using ParameterValues = std::map<std::string, double>;

}  // namespace cairn
