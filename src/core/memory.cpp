#include "cairn/core/memory.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace cairn {

constexpr double infinity = std::numeric_limits<double>::infinity();

double available_memory() {
  double kibibytes = 0;
  std::ifstream facts("/proc/meminfo");
  for (std::string key; facts >> key; facts.ignore(std::numeric_limits<std::streamsize>::max(), '\n'))
    if (key == "MemAvailable:" && facts >> kibibytes) return 1024 * kibibytes;
  return infinity;
}

double memory_limit() {
  double least = infinity;
  for (const auto resource : {RLIMIT_AS, RLIMIT_RSS}) {
    rlimit limit{};
    if (::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
      least = std::min(least, static_cast<double>(limit.rlim_cur));
  }
  return least;
}

}  // namespace cairn
