#pragma once
/// Texts changed at random: single bytes, lines, numbers and words, and pieces of other texts.

#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace cairn::fuzz {

class Mutator {
 public:
  /// `words` and `texts`: what may be put in. The same seed gives the same changes everywhere.
  Mutator(std::uint64_t seed, const std::vector<std::string>& words, const std::vector<std::string>& texts)
      : engine_(seed), words_(words), texts_(texts) {}

  /// A number below n > 0.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }
  bool one_in(std::size_t n) { return below(n) == 0; }
  template <class T>
  const T& any(const std::vector<T>& all) {
    return all[below(all.size())];
  }
  /// A number that somebody might write, most of them absurd.
  std::string number();
  /// The text after one to four changes.
  std::string mutate(std::string text);

 private:
  struct Span {
    std::size_t begin, size;
  };
  void change(std::string& text);
  void change_bytes(std::string& text);
  void change_lines(std::string& text);
  void replace_token(std::string& text, std::string_view letters, const std::string& with);
  Span any_span(const std::string& text, std::size_t most);

  std::mt19937_64 engine_;
  const std::vector<std::string>&words_, &texts_;
};

inline constexpr std::string_view digits = "0123456789.+-eE";
inline constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789";

/// The words of a text: runs of letters.
std::vector<std::string> words_of(std::string_view text);

}  // namespace cairn::fuzz
