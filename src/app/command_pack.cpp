#include <fmt/format.h>
#include <unistd.h>

#include "cairn/core/error.hpp"
#include "cairn/io/own_files.hpp"
#include "cairn/io/pack_spec.hpp"
#include "cairn/io/result_files.hpp"
#include "commands.hpp"
#include "report.hpp"

namespace cairn::app {
namespace {

/// Refuses a table that could not be written, or would take the place of what is no table of ours, before the long
/// search for the packing.
void check_target(const std::filesystem::path& out, const std::filesystem::path& spec) {
  const auto fail = [&](std::string_view text) { throw InputError(fmt::format("-o: {}: {}", out.string(), text)); };
  std::error_code status;
  const auto folder = out.has_parent_path() ? out.parent_path() : std::filesystem::path(".");
  if (std::filesystem::is_directory(out, status)) fail("is a folder; name a file");
  if (!std::filesystem::is_directory(folder, status)) fail("its folder does not exist; make it first");
  if (access(folder.c_str(), W_OK | X_OK) != 0) fail("its folder cannot be written to; choose another");
  if (same_file(out, spec)) fail("is the specification itself; name another file");
  if (const std::string reason = foreign_pack(out); !reason.empty()) throw InputError("-o: " + reason);
}

}  // namespace

int command_pack(const PackArguments& arguments) {
  return on_first_rank([&] {
    const PackSpec spec = read_pack_spec(arguments.spec);
    check_target(arguments.out, arguments.spec);
    const Pack pack = pack_grains(spec);
    const std::string error = replace_file(arguments.out, pack_table(pack, spec));
    if (!error.empty()) throw RunError(error);
    fmt::print("{}: {} grains, fraction {:.4f}, mean diameter {:.4g} m, largest overlap {:.2g} of the smaller radius\n",
               arguments.out.string(), pack.radius.size(), pack.fraction, pack.mean_diameter, pack.max_overlap);
  });
}

}  // namespace cairn::app
