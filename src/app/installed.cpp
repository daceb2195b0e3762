#include "installed.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "commands.hpp"

namespace cairn::app {
namespace {

namespace fs = std::filesystem;

constexpr std::array<Tool, 9> all_tools = {{{"plot", "Draw the pictures of a run"},
                                            {"measure", "Measure a run's grains, contacts and stresses"},
                                            {"view", "Write a run as one page for a browser"},
                                            {"report", "Write a page about a run"},
                                            {"export", "Write bodies and contacts for other programs"},
                                            {"compare-runs", "Compare two folders of results bit for bit"},
                                            {"convert-grains", "Make a grain table of another program's output"},
                                            {"convert-labels", "Make bodies of an image or a volume of labels"},
                                            {"convert-cells", "Make bodies of a tessellation, or Voronoi cells"}}};

/// The first that is there: below the prefix that the program is installed in (it lies in bin or in libexec/cairn), or
/// in the source tree that it was built from. Empty if none is.
fs::path find(const fs::path& in_prefix, const fs::path& in_source) {
  std::error_code ignored;
  const fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  for (const fs::path& candidate :
       {folder / ".." / in_prefix, folder / "../.." / in_prefix, fs::path(CAIRN_SOURCE) / in_source})
    if (fs::exists(candidate, ignored)) return fs::weakly_canonical(candidate, ignored);
  return {};
}

}  // namespace

std::span<const Tool> tools() { return all_tools; }

void become_tool(int argc, char** argv) {
  const std::string name = argc > 1 ? argv[1] : "";
  for (const Tool& tool : all_tools) {
    if (name != tool.name) continue;
    const fs::path script = find(fs::path("libexec/cairn") / name, fs::path("scripts") / name);
    if (!script.empty()) execv(script.c_str(), argv + 1);
    std::fputs(
        fmt::format("cairn {}: the script {}\n", name,
                    script.empty() ? "was not installed" : fmt::format("cannot be started: {}", std::strerror(errno)))
            .c_str(),
        stderr);
    std::exit(wrong_input);
  }
}

std::string manual() { return find("share/doc/cairn", "").string(); }

}  // namespace cairn::app
