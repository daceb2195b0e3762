#pragma once
/// What differs between two cases: a restart must not go on with another case unnoticed.

#include <string>
#include <vector>

#include "cairn/io/case.hpp"

namespace cairn {

struct KeyChange {
  std::string key;            // dotted path
  std::string before, after;  // values as TOML; "(none)" where the key is missing
};

/// Keys whose values differ between two resolved cases (Case::resolved), in the order of the keys.
/// \throws InputError if a text is not TOML
std::vector<KeyChange> case_changes(const std::string& before, const std::string& after);

/// How freely a key may change at a restart.
enum class Freedom {
  free,       // when a run ends, what it writes, how it is shared out: the state goes on as it would have
  on_demand,  // what happens from now on: with --allow-changes
  fixed,      // what the state itself is laid out by: never
};
Freedom freedom_of(const std::string& key);

/// A number that changes with any body of the case: shape, material, motion, group; also those from grain tables.
std::uint64_t bodies_checksum(const Case& c);

}  // namespace cairn
