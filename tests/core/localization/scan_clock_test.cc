#include "core/localization/scan_clock.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(ScanClockTest, WhatIsMissingCounts) {
  ScanClock clock;
  EXPECT_EQ(clock.Tick(10.0), 1.0);
  EXPECT_EQ(clock.Tick(10.25), 1.0) << "the first interval is the usual one";
  EXPECT_DOUBLE_EQ(clock.Tick(10.75), 2.0);
  EXPECT_DOUBLE_EQ(clock.Tick(11.0), 1.0);
  EXPECT_DOUBLE_EQ(clock.Tick(11.125), 0.5);
}

TEST(ScanClockTest, WithoutATimeThatGoesOnAScanIsAScan) {
  ScanClock clock;
  EXPECT_EQ(clock.Tick(std::nullopt), 1.0);
  EXPECT_EQ(clock.Tick(std::nullopt), 1.0);
  EXPECT_EQ(clock.Tick(5.0), 1.0);
  EXPECT_EQ(clock.Tick(5.0), 1.0);
  EXPECT_EQ(clock.Tick(4.0), 1.0);
  EXPECT_EQ(clock.Tick(4.5), 1.0) << "the first interval";
  EXPECT_EQ(clock.Tick(std::nullopt), 1.0);
  EXPECT_DOUBLE_EQ(clock.Tick(5.5), 2.0) << "since the last time that was told";
}

TEST(ScanClockTest, OneTimeThatIsWrongIsNoGapBehindIt) {
  ScanClock clock;
  clock.Tick(10.0);
  clock.Tick(10.5);
  EXPECT_EQ(clock.Tick(0.0), 1.0);
  EXPECT_EQ(clock.Tick(11.5), 1.0);
  EXPECT_DOUBLE_EQ(clock.Tick(12.5), 2.0) << "what is usual is still known";
}

TEST(ScanClockTest, AClockThatWasSetBackGoesOn) {
  ScanClock clock;
  clock.Tick(10.0);
  clock.Tick(10.5);
  EXPECT_EQ(clock.Tick(2.0), 1.0);
  EXPECT_EQ(clock.Tick(2.5), 1.0);
  EXPECT_DOUBLE_EQ(clock.Tick(3.5), 2.0);
}

TEST(ScanClockTest, AGapOfHoursIsALongOneAndNotMore) {
  ScanClock clock;
  clock.Tick(0.0);
  clock.Tick(0.1);
  EXPECT_EQ(clock.Tick(86'400.0), 100.0);
}

TEST(ScanClockTest, AfterARestartAllIsNew) {
  ScanClock clock;
  clock.Tick(0.0);
  clock.Tick(0.1);
  clock.Restart();
  EXPECT_EQ(clock.Tick(50.0), 1.0);
  EXPECT_EQ(clock.Tick(50.5), 1.0);
  EXPECT_DOUBLE_EQ(clock.Tick(51.5), 2.0);
}

}  // namespace
}  // namespace atlas
