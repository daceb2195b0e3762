#include "cairn/core/memory.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>

namespace cairn {

constexpr double infinity = std::numeric_limits<double>::infinity();

namespace {

/// The number in a file of a control group; infinite where there is none ("max", or a file that is not there).
double number_in(const std::string& file) {
  double value = infinity;
  std::ifstream(file) >> value;
  return value > 0 ? value : infinity;
}

/// The folder of this process's group below a mount of control groups: "0::/..." (v2) or "N:memory:/..." (v1).
std::string group_of(bool second) {
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const auto path = line.rfind(':');
    const std::string controllers = line.substr(line.find(':') + 1, path - line.find(':') - 1);
    if (second ? line.starts_with("0::") : ("," + controllers + ",").find(",memory,") != std::string::npos)
      return line.substr(path + 1);
  }
  return "/";
}

/// What the control groups from this process's up to the root leave it: limit less what is used.
double left_in_groups(const std::string& mount, std::string group, const char* limit, const char* used) {
  constexpr double unlimited = 1e18;  // v1 writes a number like that
  double least = infinity;
  while (true) {
    const std::string folder = mount + (group == "/" ? "" : group);
    const double most = number_in(folder + "/" + limit), now = number_in(folder + "/" + used);
    if (most < unlimited) least = std::min(least, std::max(0.0, most - (std::isfinite(now) ? now : 0)));
    if (group.size() <= 1) return least;
    group.erase(std::max<std::size_t>(group.rfind('/'), 1));
  }
}

double left_in_group() {
  return std::min(
      left_in_groups("/sys/fs/cgroup", group_of(true), "memory.max", "memory.current"),
      left_in_groups("/sys/fs/cgroup/memory", group_of(false), "memory.limit_in_bytes", "memory.usage_in_bytes"));
}

double free_on_machine() {
  double kibibytes = 0;
  std::ifstream facts("/proc/meminfo");
  for (std::string key; facts >> key; facts.ignore(std::numeric_limits<std::streamsize>::max(), '\n'))
    if (key == "MemAvailable:" && facts >> kibibytes) return 1024 * kibibytes;
  return infinity;
}

}  // namespace

double available_memory() { return std::min(free_on_machine(), left_in_group()); }

double memory_limit() {
  double least = infinity;
  for (const auto resource : {RLIMIT_AS, RLIMIT_RSS}) {
    rlimit limit{};
    if (::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
      least = std::min(least, static_cast<double>(limit.rlim_cur));
  }
  return least;
}

int ranks_on_machine() {
  for (const char* name : {"OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "SLURM_NTASKS_PER_NODE"})
    if (const char* text = std::getenv(name)) return std::max(1, std::atoi(text));
  return 1;
}

}  // namespace cairn
