#include "server/net/connection/frame_clock.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

using std::chrono::seconds;

class FrameClockTest : public testing::Test {
 protected:
  FrameClockTest() {
    options_.handshake = seconds(5);
    options_.idle = seconds(3'600);
    options_.frame = seconds(30);
    options_.min_bytes_per_s = 1'000;
  }

  NetOptions options_;
  const FrameClock::Time start_{};
  FrameClock clock_{start_, options_};
};

TEST_F(FrameClockTest, BeginsWithTheHandshake) {
  EXPECT_EQ(clock_.deadline(), start_ + seconds(5));
  EXPECT_FALSE(clock_.is_mid_frame());
}

TEST_F(FrameClockTest, WaitsLongForTheNextFrame) {
  clock_.Expect(start_ + seconds(1), 0);
  EXPECT_EQ(clock_.deadline(), start_ + seconds(3'601));
}

TEST_F(FrameClockTest, ATrickleBuysNoTime) {
  for (int i = 1; i <= 20; ++i) {
    clock_.Expect(start_ + seconds(i), static_cast<std::size_t>(i));
  }
  EXPECT_TRUE(clock_.is_mid_frame());
  EXPECT_EQ(clock_.deadline(), start_ + seconds(31) + std::chrono::milliseconds(19));
}

// Else 46 MiB sent at once could wait for the rest for hours.
TEST_F(FrameClockTest, WhatCameFastBuysNoMoreThanAnyOther) {
  clock_.Expect(start_, 10);
  clock_.Expect(start_ + seconds(1), 46u << 20);
  EXPECT_EQ(clock_.deadline(), start_ + seconds(31));
}

TEST_F(FrameClockTest, AStallAfterASlowBeginningEndsNoLater) {
  clock_.Expect(start_, 10);
  for (int i = 1; i <= 20; ++i) {  // half the slowest rate
    clock_.Expect(start_ + seconds(i), 10 + 500 * static_cast<std::size_t>(i));
  }
  EXPECT_EQ(clock_.deadline(), start_ + seconds(40));
}

TEST_F(FrameClockTest, ASlowLinkGetsThrough) {
  for (int i = 1; i <= 1'000; ++i) {  // twice the slowest rate
    const auto now = start_ + seconds(i);
    EXPECT_TRUE(i == 1 || now < clock_.deadline()) << i;
    clock_.Expect(now, 2'000 * static_cast<std::size_t>(i));
  }
  clock_.Expect(start_ + seconds(1'001), 0);
  EXPECT_FALSE(clock_.is_mid_frame());
}

TEST_F(FrameClockTest, NobodysFaultIsNotCounted) {
  clock_.Expect(start_, 10);
  clock_.Restart(start_ + seconds(100), 10);
  EXPECT_EQ(clock_.deadline(), start_ + seconds(130));
}

}  // namespace
}  // namespace atlas
