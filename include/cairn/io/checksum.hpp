#pragma once
/// A 64-bit checksum of bytes: XXH64 of Y. Collet (github.com/Cyan4973/xxHash, specification 0.2.0), seed 0. Several
/// gigabytes a second; any change within eight neighbouring bytes changes it, and any other with all but certainty.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace cairn {

/// Checksum of bytes that come in parts; how they are cut does not matter.
class Checksum {
 public:
  void add(std::span<const std::byte> bytes);
  template <class T>
  void add_values(std::span<const T> values) {
    add(std::as_bytes(values));
  }
  /// Of all bytes so far.
  std::uint64_t value() const;

 private:
  static constexpr std::size_t stripe = 32;
  void mix(const std::byte* bytes);

  static constexpr std::uint64_t prime_1 = 0x9E3779B185EBCA87ULL, prime_2 = 0xC2B2AE3D27D4EB4FULL;
  std::array<std::uint64_t, 4> lanes_ = {prime_1 + prime_2, prime_2, 0, 0 - prime_1};
  std::array<std::byte, stripe> rest_{};  // bytes that do not fill a stripe yet
  std::size_t rest_size_ = 0;
  std::uint64_t size_ = 0;
};

template <class T>
std::uint64_t checksum(std::span<const T> values) {
  Checksum sum;
  sum.add_values(values);
  return sum.value();
}

}  // namespace cairn
