#pragma once
/// The ways a run ends early: the input is wrong (exit 2), or the run failed (exit 3), on all ranks or on one.

#include <stdexcept>
#include <string>
#include <vector>

namespace cairn {

/// The input is wrong; nothing was created. Holds every error found, each one line: where, what, and the remedy.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::string message) : InputError(std::vector<std::string>{std::move(message)}) {}
  explicit InputError(std::vector<std::string> messages)
      : std::runtime_error(join(messages)), messages_(std::move(messages)) {}
  const std::vector<std::string>& messages() const { return messages_; }

 private:
  static std::string join(const std::vector<std::string>& lines) {
    std::string all;
    for (const auto& line : lines) all += (all.empty() ? "" : "\n") + line;
    return all;
  }
  std::vector<std::string> messages_;
};

/// The run failed, and every rank knows it: says at which step, where and why.
class RunError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One rank failed, and the others do not know: they may wait for it anywhere, so that nothing collective can follow.
class RankError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cairn
