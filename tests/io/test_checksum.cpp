#include <gtest/gtest.h>

#include <numeric>
#include <string_view>
#include <vector>

#include "cairn/io/checksum.hpp"

namespace {

using namespace cairn;

std::uint64_t of_text(std::string_view text) { return checksum(std::span(text.data(), text.size())); }

// Reference values of the xxhash project.
TEST(Checksum, KnownValues) {
  EXPECT_EQ(of_text(""), 0xEF46DB3751D8E999U);
  EXPECT_EQ(of_text("a"), 0xD24EC4F1A98C6E5BU);
  EXPECT_EQ(of_text("abc"), 0x44BC2CF5AD770999U);
  EXPECT_EQ(of_text("Call me Ishmael. Some years ago--never mind how long precisely-"), 0x02A2E85470D6FD96U);
}

TEST(Checksum, PartsDoNotMatter) {
  std::vector<std::uint8_t> bytes(1000);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  const std::span all(std::as_const(bytes));
  const std::uint64_t whole = checksum(all);
  for (const std::size_t part : {1, 3, 8, 31, 32, 33, 64, 999}) {
    Checksum sum;
    for (std::size_t at = 0; at < bytes.size(); at += part)
      sum.add_values(all.subspan(at, std::min(part, bytes.size() - at)));
    EXPECT_EQ(sum.value(), whole) << part;
  }
}

TEST(Checksum, EveryByteCounts) {
  std::vector<std::uint8_t> bytes(77, 5);
  const std::uint64_t whole = checksum(std::span<const std::uint8_t>(bytes));
  for (auto& byte : bytes)
    for (const std::uint8_t change : {1, 128, 255}) {
      byte ^= change;
      EXPECT_NE(checksum(std::span<const std::uint8_t>(bytes)), whole);
      byte ^= change;
    }
}

}  // namespace
