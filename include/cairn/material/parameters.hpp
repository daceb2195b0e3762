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
};

struct LawInfo {
  std::string_view name;
  std::span<const Parameter> parameters;
};

using ParameterValues = std::map<std::string, double>;

}  // namespace cairn
