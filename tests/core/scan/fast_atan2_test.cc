#include "core/scan/fast_atan2.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr double kError_rad = 1.2e-5;  // the polynomial's 1e-5 and the floats around it

TEST(FastAtan2Test, IsWithinItsErrorAtAnyScale) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> angle(-M_PI, M_PI);
  std::uniform_real_distribution<double> exponent(-6.0, 6.0);
  for (int i = 0; i < 100'000; ++i) {
    const double a = angle(random);
    const double length = std::pow(10.0, exponent(random));
    const auto x = static_cast<float>(length * std::cos(a));
    const auto y = static_cast<float>(length * std::sin(a));
    ASSERT_NEAR(FastAtan2(y, x), std::atan2(double{y}, double{x}), kError_rad) << x << " " << y;
  }
}

TEST(FastAtan2Test, MirroredPointsHaveMirroredAngles) {
  std::mt19937 random(12);
  std::uniform_real_distribution<float> coordinate(0.01F, 100.0F);
  for (int i = 0; i < 10'000; ++i) {
    const float x = coordinate(random);
    const float y = coordinate(random);
    EXPECT_EQ(FastAtan2(-y, x), -FastAtan2(y, x));
    EXPECT_EQ(FastAtan2(-y, -x), -FastAtan2(y, -x));
    EXPECT_NEAR(FastAtan2(y, -x), M_PI - FastAtan2(y, x), 1e-6);
  }
}

TEST(FastAtan2Test, AxesAndDiagonalsAreWhereTheyAre) {
  EXPECT_EQ(FastAtan2(0.0F, 3.0F), 0.0F);
  EXPECT_NEAR(FastAtan2(3.0F, 0.0F), M_PI / 2, kError_rad);
  EXPECT_NEAR(FastAtan2(-3.0F, 0.0F), -M_PI / 2, kError_rad);
  EXPECT_NEAR(std::abs(FastAtan2(0.0F, -3.0F)), M_PI, kError_rad);
  EXPECT_NEAR(std::abs(FastAtan2(-0.0F, -3.0F)), M_PI, kError_rad);
  for (const float s : {1e-20F, 1.0F, 1e15F}) {
    EXPECT_NEAR(FastAtan2(s, s), M_PI / 4, kError_rad);
    EXPECT_NEAR(FastAtan2(-s, -s), -3 * M_PI / 4, kError_rad);
  }
}

TEST(FastAtan2Test, NeverLeavesTheCircle) {
  std::mt19937 random(13);
  std::uniform_real_distribution<float> offset(-1e-6F, 1e-6F);
  for (int i = 0; i < 10'000; ++i) {
    for (const float x : {-5.0F, 5.0F, 0.0F}) {
      const float angle = FastAtan2(offset(random), x);
      EXPECT_LE(std::abs(angle), std::numbers::pi_v<float>);
    }
  }
}

}  // namespace
}  // namespace atlas
