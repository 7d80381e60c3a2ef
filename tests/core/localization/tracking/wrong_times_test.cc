// A sensor that turns evenly, and whoever tells when its scans were made errs (decision 0637).
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "core/localization/localizer.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::UprightPose;

constexpr double kStep_m = 1.25;

Pose OnStreet(double x_m) {
  return UprightPose({x_m, 0.1, 1.8 + 0.01 * x_m}, 0.0);
}

Localizer Started() {
  Localizer localizer(testing::StreetMap().profile(), testing::StreetMap().Source(),
                      testing::QuickOptions());
  localizer.Start(OnStreet(-14.0));
  return localizer;
}

// The scan after so many true intervals, and as many as are told.
void ExpectFound(Localizer& localizer, double x_m, double told) {
  const LeveledScan scan =
      CastLeveledScan(testing::QuickSensor(), testing::Street(), OnStreet(x_m));
  const auto result = localizer.Localize(scan, Eigen::Quaterniond::Identity(), told);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->health, LocalizationHealth::kGood) << x_m;
  EXPECT_LT(ErrorOf(result->T_world_sensor, OnStreet(x_m)).horizontal_m, 0.06) << x_m;
}

TEST(WrongTimesTest, OneThatIsLateIsNoSpeed) {
  constexpr std::array<double, 10> kTold{1.0, 1.0, 1.0, 1.8, 0.2, 1.0, 1.0, 1.4, 0.6, 1.0};
  Localizer localizer = Started();
  for (std::size_t i = 0; i < kTold.size(); ++i) {
    ExpectFound(localizer, -14.0 + kStep_m * static_cast<double>(i), kTold.at(i));
    if (i >= 2) {
      EXPECT_NEAR(localizer.T_now_later().translation().x(), kStep_m, 0.1) << i;
    }
  }
}

TEST(WrongTimesTest, NorAreTheFirstOnes) {
  constexpr std::array<double, 6> kTold{1.0, 0.45, 1.36, 0.9, 1.2, 1.0};
  Localizer localizer = Started();
  for (std::size_t i = 0; i < kTold.size(); ++i) {
    ExpectFound(localizer, -14.0 + kStep_m * static_cast<double>(i), kTold.at(i));
    if (i >= 1) {  // a tenth of an interval is too little to tell
      EXPECT_NEAR(localizer.T_now_later().translation().x(), kStep_m, 0.15) << i;
    }
  }
}

TEST(WrongTimesTest, WhatIsMissingIs) {
  constexpr std::array<double, 8> kTold{1.0, 1.0, 1.0, 3.0, 1.0, 2.0, 1.0, 1.0};
  Localizer localizer = Started();
  double x_m = -14.0 - kStep_m;
  for (std::size_t i = 0; i < kTold.size(); ++i) {
    x_m += kStep_m * kTold.at(i);
    ExpectFound(localizer, x_m, kTold.at(i));
    if (i >= 2) {
      EXPECT_NEAR(localizer.T_now_later().translation().x(), kStep_m, 0.1) << i;
    }
  }
}

}  // namespace
}  // namespace atlas
