#pragma once
/// A number as a formula of time, read from text.

#include <memory>
#include <string>

namespace cairn {

/// What muparser reads: + - * / ^, comparisons, a ? b : c, sin, exp, min ... , of t [s] and the constant pi. All ranks
/// evaluate it alike.
class Formula {
 public:
  /// \throws InputError that says what is wrong with the text
  explicit Formula(std::string text);
  /// \throws RunError where it has no finite value
  double at(double t) const;
  const std::string& text() const { return text_; }
  friend bool operator==(const Formula& a, const Formula& b) { return a.text_ == b.text_; }

 private:
  struct Parser;
  std::string text_;
  std::shared_ptr<Parser> parser_;  // copies share it
};

}  // namespace cairn
