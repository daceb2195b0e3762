#pragma once
/// What a run will hold, foretold from its case.

#include <string>

#include "cairn/io/case.hpp"

namespace cairn::app {

struct Estimate {
  double points = 0, bytes = 0;  // of all ranks
};

/// Points from the volumes; memory from the points, the nodes that the bodies reach and what travels between patches.
Estimate estimate(const Case& c, int ranks);

/// "12.3 MB"
std::string size_text(double bytes);

/// Says where this machine, or the process, cannot give its ranks' share of what the run needs.
void warn_of_memory(double bytes, int ranks);

}  // namespace cairn::app
