#pragma once
/// Files of the source tree that the program holds: CMakeLists.txt writes the source that does.

#include <string_view>

namespace cairn::app {

extern const std::string_view first_case;      // cases/first.toml
extern const std::string_view case_file_page;  // docs/case-file.md

}  // namespace cairn::app
