#include "core/localization/scan_clock.h"

#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(ScanClockTest, WhatIsMissingCounts) {
  ScanClock clock;
  EXPECT_EQ(clock.Tick(10.0), 1.0);
  EXPECT_EQ(clock.Tick(10.25), 1.0) << "the only one is the usual one";
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
  EXPECT_DOUBLE_EQ(clock.Tick(5.5), 1.0)
      << "two since the last time that was told, one of them counted";
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

TEST(ScanClockTest, AfterARestartTheSensorIsTheSame) {
  ScanClock clock;
  clock.Tick(0.0);
  clock.Tick(0.1);
  clock.Restart();
  EXPECT_EQ(clock.Tick(50.0), 1.0);
  EXPECT_NEAR(clock.Tick(50.2), 2.0, 1e-9);
}

// The first interval is as wrong as any: deskewing went by it for the whole drive.
TEST(ScanClockTest, WhatIsMissingAtTheBeginningIsNotTheUsualInterval) {
  for (const int missing : {1, 3, 30}) {
    ScanClock clock;
    clock.Tick(0.0);
    double time_s = 0.25 * (missing + 1);
    EXPECT_EQ(clock.Tick(time_s), 1.0);
    for (int i = 0; i < 300; ++i) {
      EXPECT_NEAR(clock.Tick(time_s += 0.25), 1.0, 1e-9) << missing;
    }
    EXPECT_NEAR(clock.Tick(time_s += 0.75), 3.0, 1e-9);
  }
}

TEST(ScanClockTest, ASensorThatIsKnownHasNothingToLearn) {
  ScanClock clock(0.1);
  clock.Tick(0.0);
  EXPECT_NEAR(clock.Tick(0.3), 3.0, 1e-9);
  EXPECT_NEAR(clock.Tick(0.4), 1.0, 1e-9);
}

TEST(ScanClockTest, AnIntervalThatIsTooShortIsForgottenAfterThree) {
  ScanClock clock;
  clock.Tick(0.0);
  double time_s = 0.005;
  clock.Tick(time_s);
  for (int i = 0; i < 300; ++i) {
    const double scans = clock.Tick(time_s += 0.25);
    if (i >= 2) {
      EXPECT_NEAR(scans, 1.0, 1e-9) << i;
    }
  }
}

TEST(ScanClockTest, HalfOfTheScansMayBeMissing) {
  std::mt19937 random(1);
  ScanClock clock;
  double time_s = 0.0;
  clock.Tick(time_s);
  for (int i = 0; i < 1'000; ++i) {
    const int intervals = 1 + (random() % 2 == 0 ? 1 : 0) + (random() % 8 == 0 ? 2 : 0);
    const double scans = clock.Tick(time_s += 0.1 * intervals);
    if (i >= 20) {
      EXPECT_NEAR(scans, intervals, 1e-6) << i;
    }
  }
}

// As times of arrival do.
TEST(ScanClockTest, TimesThatJitterAreEvenOnAverage) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> late_s(0.0, 0.02);
  ScanClock clock;
  double scans = 0.0;
  for (int i = 0; i <= 200; ++i) {
    const double told = clock.Tick(0.1 * i + late_s(random));
    if (i > 100) scans += told;
  }
  EXPECT_NEAR(scans, 100.0, 1.0);
}

TEST(ScanClockTest, AScanOfUnknownTimeCountsAtTheNextOne) {
  ScanClock clock(0.1);
  clock.Tick(0.0);
  EXPECT_EQ(clock.Tick(std::nullopt), 1.0);
  EXPECT_NEAR(clock.Tick(0.2), 1.0, 1e-9);
  EXPECT_EQ(clock.Tick(std::nullopt), 1.0);
  EXPECT_EQ(clock.Tick(std::nullopt), 1.0);
  EXPECT_NEAR(clock.Tick(0.7), 3.0, 1e-9) << "two are missing";
  EXPECT_NEAR(clock.Tick(0.8), 1.0, 1e-9) << "they are forgotten";
  EXPECT_EQ(clock.Tick(std::nullopt), 1.0);
  EXPECT_GT(clock.Tick(0.85), 0.0) << "whatever times say";
}

TEST(ScanClockTest, OfScansWithoutATimeNothingIsLearnt) {
  ScanClock clock;
  clock.Tick(0.0);
  EXPECT_EQ(clock.Tick(std::nullopt), 1.0);
  EXPECT_EQ(clock.Tick(0.2), 1.0) << "two intervals, which nobody knows yet";
  EXPECT_EQ(clock.Tick(0.3), 1.0) << "the first one that is known";
  EXPECT_NEAR(clock.Tick(0.5), 2.0, 1e-9);
}

TEST(ScanClockTest, AnotherPaceIsLearnt) {
  ScanClock clock;
  double time_s = 0.0;
  for (int i = 0; i < 100; ++i) clock.Tick(time_s += 0.05);
  for (int i = 0; i < 100; ++i) clock.Tick(time_s += 0.1);
  EXPECT_NEAR(clock.Tick(time_s += 0.1), 1.0, 1e-9);
}

}  // namespace
}  // namespace atlas
