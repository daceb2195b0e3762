#include <fmt/format.h>

#include "cairn/core/printable.hpp"
#include "cairn/io/info.hpp"
#include "commands.hpp"
#include "report.hpp"

namespace cairn::app {

int command_info(const std::filesystem::path& file) {
  return on_first_rank([&] {
    const std::string text = printable(describe_file(file), true);
    fmt::print("{}{}", text, text.ends_with('\n') ? "" : "\n");
  });
}

}  // namespace cairn::app
