// Boxes of lattice positions against plain enumeration.

#include <gtest/gtest.h>

#include <set>

#include "../support/random.hpp"
#include "cairn/grid/box.hpp"

namespace cairn {
namespace {

template <int Dim>
Box<Dim> random_box(test::Random& random) {
  Box<Dim> box;
  for (int d = 0; d < Dim; ++d) {
    box.lower[d] = random.integer(-4, 4);
    box.upper[d] = box.lower[d] + random.integer(0, 5);
  }
  return box;
}

/// Every position of the box, x fastest, found without its own functions.
template <int Dim>
std::vector<Index<Dim>> positions(const Box<Dim>& box) {
  std::vector<Index<Dim>> all;
  const int z0 = Dim == 3 ? box.lower[Dim - 1] : 0, z1 = Dim == 3 ? box.upper[Dim - 1] : 1;
  for (int z = z0; z < z1; ++z)
    for (int y = box.lower[1]; y < box.upper[1]; ++y)
      for (int x = box.lower[0]; x < box.upper[0]; ++x) {
        Index<Dim> i;
        i[0] = x, i[1] = y;
        if constexpr (Dim == 3) i[2] = z;
        all.push_back(i);
      }
  return all;
}

template <int Dim>
std::set<Index<Dim>> as_set(const Box<Dim>& box) {
  const auto all = positions(box);
  return {all.begin(), all.end()};
}

template <int Dim>
void check_walk() {
  test::Random random;
  for (int k = 0; k < 300; ++k) {
    const auto box = random_box<Dim>(random);
    const auto expected = positions(box);
    std::vector<Index<Dim>> walked;
    for_each(box, [&](const Index<Dim>& i) {
      EXPECT_EQ(box.offset(i), static_cast<int>(walked.size()));
      EXPECT_TRUE(box.contains(i));
      walked.push_back(i);
    });
    EXPECT_EQ(walked, expected);
    EXPECT_EQ(box.size(), expected.size());
    EXPECT_EQ(box.empty(), expected.empty());
    for (int d = 0; d < Dim; ++d) {
      Index<Dim> next = box.lower;
      ++next[d];
      EXPECT_EQ(box.stride(d), box.offset(next));
    }
  }
}
TEST(Box, WalksEveryPositionInOrder) {
  check_walk<2>();
  check_walk<3>();
}

template <int Dim>
void check_sets() {
  test::Random random;
  for (int k = 0; k < 300; ++k) {
    const auto a = random_box<Dim>(random), b = random_box<Dim>(random);
    const auto in_a = as_set(a), in_b = as_set(b);
    std::set<Index<Dim>> both;
    for (const auto& i : in_a)
      if (in_b.count(i) > 0) both.insert(i);
    EXPECT_EQ(as_set(intersection(a, b)), both);
    if (!in_b.empty()) {
      EXPECT_EQ(a.contains(b), both == in_b);
    }

    const auto whole = hull(a, b);
    for (const auto& i : in_a) EXPECT_TRUE(whole.contains(i));
    for (const auto& i : in_b) EXPECT_TRUE(whole.contains(i));
    Box<Dim> expected = a.empty() ? b : a;
    for (int d = 0; d < Dim && !a.empty() && !b.empty(); ++d) {
      expected.lower[d] = std::min(a.lower[d], b.lower[d]);
      expected.upper[d] = std::max(a.upper[d], b.upper[d]);
    }
    EXPECT_EQ(whole, expected);
  }
}
TEST(Box, IntersectionAndHullAreThoseOfSets) {
  check_sets<2>();
  check_sets<3>();
}

template <int Dim>
void check_rows() {
  test::Random random;
  for (int k = 0; k < 200; ++k) {
    const auto outer = random_box<Dim>(random);
    const auto inner = intersection(outer, random_box<Dim>(random));
    std::vector<int> offsets, expected;
    for_each_row(inner, outer, [&](int first, int n) {
      for (int i = 0; i < n; ++i) offsets.push_back(first + i);
    });
    for (const auto& i : positions(inner)) expected.push_back(outer.offset(i));
    EXPECT_EQ(offsets, expected);
  }
}
TEST(Box, RowsCoverTheInnerBox) {
  check_rows<2>();
  check_rows<3>();
}

TEST(Box, Shifts) {
  const Box<2> box{{1, -2}, {4, 3}};
  EXPECT_EQ(box.shifted({-5, 2}), (Box<2>{{-4, 0}, {-1, 5}}));
}

}  // namespace
}  // namespace cairn
