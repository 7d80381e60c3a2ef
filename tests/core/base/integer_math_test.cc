#include "core/base/integer_math.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(IntegerMathTest, DivisionRoundsTowardsMinusInfinityOrToNearest) {
  EXPECT_EQ(FloorDiv(7, 2), 3);
  EXPECT_EQ(FloorDiv(-7, 2), -4);
  EXPECT_EQ(FloorDiv(-8, 2), -4);
  EXPECT_EQ(RoundDiv(5, 2), 3);
  EXPECT_EQ(RoundDiv(-5, 2), -2);  // halves up
  EXPECT_EQ(RoundDiv(-6, 4), -1);
  EXPECT_EQ(RoundDiv(7, 3), 2);
  EXPECT_EQ(RoundDiv(-7, 3), -2);
}

TEST(IntegerMathTest, WideDivisionAgreesWithTheNarrowOne) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 10'000; ++i) {
    const auto a = static_cast<std::int64_t>(random()) >> 2;
    const auto b = static_cast<std::int64_t>(random() >> (2 + random() % 60)) + 1;
    EXPECT_EQ(RoundDiv128(a, b), RoundDiv(a, b)) << a << " / " << b;
  }
}

TEST(IntegerMathTest, SquareRootIsTheFloor) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t root = random() >> (32 + random() % 32);
    EXPECT_EQ(Isqrt(root * root), root);
    if (root > 0) {
      EXPECT_EQ(Isqrt(root * root - 1), root - 1);
      EXPECT_EQ(Isqrt(root * root + root), root);
    }
  }
  EXPECT_EQ(Isqrt(std::numeric_limits<std::uint64_t>::max()), 0xFFFFFFFFu);
}

}  // namespace
}  // namespace atlas
