#pragma once
/// Text from files and arguments on its way to a terminal.

#include <string>
#include <string_view>

namespace cairn {

/// The text without what a terminal would act on: control characters, those of eight bits (U+0080 to U+009F) among
/// them, become '?'. Ends of lines stay where `lines` says so.
inline std::string printable(std::string_view text, bool lines = false) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto code = static_cast<unsigned char>(text[i]);
    const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
    if (code == 0xC2 && next >= 0x80 && next < 0xA0) {
      result += '?', ++i;
    } else {
      result += (code < 32 && !(lines && code == '\n')) || code == 127 ? '?' : text[i];
    }
  }
  return result;
}

}  // namespace cairn
