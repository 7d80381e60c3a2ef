#include "core/column/half_segments.h"

#include <bit>
#include <cmath>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(HalfSegmentsTest, ASegmentIsItsTwoHalves) {
  for (const float height_m : {0.1F, 0.25F, 0.5F, 1.0F, 2.0F}) {
    const HalfSegments halves(height_m, -1.73F);
    for (int segment = -7; segment < 5; ++segment) {
      const float middle_m = (static_cast<float>(segment) + 0.5F) * height_m;
      const HalfMask mask = halves.SegmentAt(middle_m);
      EXPECT_EQ(mask, halves.Bit(2 * segment) | halves.Bit(2 * segment + 1));
      if (mask != 0) {
        EXPECT_EQ(std::popcount(mask), 2);
        EXPECT_EQ(std::popcount(mask & kLowerHalves), 1);
        EXPECT_EQ(halves.From(segment, mask), 3U);  // at its own anchor
      }
    }
  }
}

TEST(HalfSegmentsTest, ReachesFromEightBelowTheFootToTwentyFourAbove) {
  const HalfSegments halves(1.0F, -1.73F);  // the foot is in segment -2
  EXPECT_EQ(halves.SegmentAt(-10.5F), 0U);
  EXPECT_EQ(halves.SegmentAt(-9.5F), 3U);
  EXPECT_EQ(halves.SegmentAt(21.5F), HalfMask{3} << 62);
  EXPECT_EQ(halves.SegmentAt(22.5F), 0U);
  EXPECT_EQ(halves.SegmentAt(1e6F), 0U);
  EXPECT_EQ(halves.SegmentAt(-1e6F), 0U);
}

TEST(HalfSegmentsTest, ARayIsPastWhenNothingInReachFollows) {
  for (const float foot_m : {-0.3F, -1.73F, -3.2F}) {
    const HalfSegments halves(0.1F, foot_m);
    for (int half = -150; half < 150; ++half) {
      bool is_in_reach_above = false;
      bool is_in_reach_below = false;
      for (int k = 0; k < 300; ++k) {
        is_in_reach_above |= halves.Bit(half + k) != 0;
        is_in_reach_below |= halves.Bit(half - k) != 0;
      }
      EXPECT_EQ(halves.IsPast(half, 1), !is_in_reach_above) << half;
      EXPECT_EQ(halves.IsPast(half, -1), !is_in_reach_below) << half;
    }
  }
}

TEST(HalfSegmentsTest, BelowTheSensorAreTheSegmentsThatEndThere) {
  for (const float height_m : {0.1F, 0.5F, 1.0F, 2.0F}) {
    for (const float foot_m : {-0.3F, -1.73F, -2.6F, -5.0F}) {
      const HalfSegments halves(height_m, foot_m);
      HalfMask expected = 0;
      for (int segment = -100; segment < 0; ++segment) {
        expected |= halves.Bit(2 * segment) | halves.Bit(2 * segment + 1);
      }
      EXPECT_EQ(halves.Below(0.0F), expected) << height_m << " " << foot_m;
      EXPECT_EQ(halves.Below(0.99F * height_m), expected);
      EXPECT_EQ(halves.Below(-100.0F), 0U);
    }
  }
}

TEST(HalfSegmentsTest, AnchorsAnywhereShiftAndNeverWrap) {
  const HalfSegments halves(0.5F, -1.8F);
  const HalfMask all = ~HalfMask{0};
  for (int anchor = -100; anchor <= 100; ++anchor) {
    const HalfMask mask = halves.From(anchor, all);
    for (int k = 0; k < 32; ++k) {
      const bool is_in_reach = halves.Bit(2 * (anchor + k)) != 0;
      EXPECT_EQ(((mask >> (2 * k)) & 3) == 3, is_in_reach) << anchor << " " << k;
    }
  }
}

}  // namespace
}  // namespace atlas
