#pragma once
/// A 64-bit checksum of bytes: XXH64 of libxxhash, seed 0. Several gigabytes a second; any change within eight
/// neighbouring bytes changes it, and any other with all but certainty.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

struct XXH64_state_s;

namespace cairn {

/// Checksum of bytes that come in parts; how they are cut does not matter.
class Checksum {
 public:
  Checksum();
  void add(std::span<const std::byte> bytes);
  template <class T>
  void add_values(std::span<const T> values) {
    add(std::as_bytes(values));
  }
  /// Of all bytes so far.
  std::uint64_t value() const;

 private:
  struct Free {
    void operator()(XXH64_state_s* state) const;
  };
  std::unique_ptr<XXH64_state_s, Free> state_;
};

template <class T>
std::uint64_t checksum(std::span<const T> values) {
  Checksum sum;
  sum.add_values(values);
  return sum.value();
}

}  // namespace cairn
