#include "cairn/io/checksum.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace cairn {

namespace {

constexpr std::uint64_t prime_1 = 0x9E3779B185EBCA87ULL, prime_2 = 0xC2B2AE3D27D4EB4FULL,
                        prime_3 = 0x165667B19E3779F9ULL, prime_4 = 0x85EBCA77C2B2AE63ULL,
                        prime_5 = 0x27D4EB2F165667C5ULL;

template <class T>
std::uint64_t read(const std::byte* bytes) {
  T word;
  std::memcpy(&word, bytes, sizeof word);
  return word;
}

std::uint64_t round_of(std::uint64_t lane, std::uint64_t word) {
  return std::rotl(lane + word * prime_2, 31) * prime_1;
}

}  // namespace

void Checksum::mix(const std::byte* bytes) {
  for (std::size_t i = 0; i < lanes_.size(); ++i) lanes_[i] = round_of(lanes_[i], read<std::uint64_t>(bytes + 8 * i));
}

void Checksum::add(std::span<const std::byte> bytes) {
  size_ += bytes.size();
  if (rest_size_ > 0) {
    const std::size_t taken = std::min(stripe - rest_size_, bytes.size());
    std::copy_n(bytes.begin(), taken, rest_.begin() + static_cast<std::ptrdiff_t>(rest_size_));
    rest_size_ += taken;
    bytes = bytes.subspan(taken);
    if (rest_size_ < stripe) return;
    mix(rest_.data());
    rest_size_ = 0;
  }
  for (; bytes.size() >= stripe; bytes = bytes.subspan(stripe)) mix(bytes.data());
  std::copy(bytes.begin(), bytes.end(), rest_.begin());
  rest_size_ = bytes.size();
}

std::uint64_t Checksum::value() const {
  std::uint64_t h = lanes_[2] + prime_5;
  if (size_ >= stripe) {
    h = std::rotl(lanes_[0], 1) + std::rotl(lanes_[1], 7) + std::rotl(lanes_[2], 12) + std::rotl(lanes_[3], 18);
    for (const std::uint64_t lane : lanes_) h = (h ^ round_of(0, lane)) * prime_1 + prime_4;
  }
  h += size_;
  std::size_t at = 0;
  for (; at + 8 <= rest_size_; at += 8)
    h = std::rotl(h ^ round_of(0, read<std::uint64_t>(&rest_[at])), 27) * prime_1 + prime_4;
  for (; at + 4 <= rest_size_; at += 4)
    h = std::rotl(h ^ read<std::uint32_t>(&rest_[at]) * prime_1, 23) * prime_2 + prime_3;
  for (; at < rest_size_; ++at) h = std::rotl(h ^ read<std::uint8_t>(&rest_[at]) * prime_5, 11) * prime_1;
  h = (h ^ h >> 33) * prime_2;
  h = (h ^ h >> 29) * prime_3;
  return h ^ h >> 32;
}

}  // namespace cairn
