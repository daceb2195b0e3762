#pragma once
/// Reading of SPEC.toml, what `cairn pack` makes a pack from. The keys are described in body/pack.hpp.

#include <filesystem>

#include "cairn/body/pack.hpp"

namespace cairn {

/// Reads and checks a pack specification.
/// \throws InputError with every error found; each names file, line, key and remedy.
PackSpec read_pack_spec(const std::filesystem::path& file);

}  // namespace cairn
