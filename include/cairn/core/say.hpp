#pragma once
/// Words for whoever watches a run.

#include <fmt/format.h>

#include <cstdio>
#include <utility>

namespace cairn {

/// Writes formatted text. That nobody reads it any more, as at a closed pipe, is no failure of the run: fmt::print
/// would throw where the stream has no buffer.
template <class... Values>
void say(std::FILE* stream, fmt::format_string<Values...> format, Values&&... values) {
  std::fputs(fmt::format(format, std::forward<Values>(values)...).c_str(), stream);
}

}  // namespace cairn
