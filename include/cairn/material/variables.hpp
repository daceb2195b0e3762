#pragma once
/// What laws keep in their points.

#include <string_view>
#include <vector>

namespace cairn {

/// Names of the state variables of all laws, each once.
std::vector<std::string_view> law_variables();

}  // namespace cairn
