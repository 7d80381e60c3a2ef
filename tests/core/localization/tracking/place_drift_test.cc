#include "core/localization/tracking/place_drift.h"

#include <numbers>
#include <optional>

#include <gtest/gtest.h>

namespace atlas {
namespace {

const Eigen::Vector4d kAhead(0.1, 0.0, 0.0, 0.0);

TEST(PlaceDriftTest, AKnownPlaceStraysBySmallStepsThatAddUp) {
  PlaceDrift drift((PlaceDriftOptions()));
  int scans = 0;
  while (!drift.HasStrayed() && scans < 100) {
    drift.Fade();
    drift.Stray(kAhead);
    ++scans;
  }
  EXPECT_EQ(scans, 4) << "0.1, 0.19, 0.27 and 0.34 m";
  drift.Return();
  EXPECT_FALSE(drift.HasStrayed());
}

TEST(PlaceDriftTest, WhatErrsEitherWayIsForgotten) {
  PlaceDrift drift((PlaceDriftOptions()));
  for (int scan = 0; scan < 100; ++scan) {
    drift.Fade();
    drift.Stray(scan % 2 == 0 ? kAhead : Eigen::Vector4d(-kAhead));
    EXPECT_FALSE(drift.HasStrayed()) << scan;
  }
}

TEST(PlaceDriftTest, ATurnIsStrayingToo) {
  PlaceDrift drift((PlaceDriftOptions()));
  drift.Stray({0.0, 0.0, 0.0, -0.06});
  EXPECT_TRUE(drift.HasStrayed());
}

TEST(PlaceDriftTest, ASupposedPlaceThatSlidesDoesNotMoveAlong) {
  PlaceDrift drift((PlaceDriftOptions()));
  for (int scan = 0; scan < 5; ++scan) EXPECT_TRUE(drift.MovesAlong(kAhead)) << scan;
  EXPECT_FALSE(drift.MovesAlong(kAhead)) << "0.6 m in all, by no step as far as that";
  EXPECT_TRUE(drift.MovesAlong(kAhead)) << "it begins anew";
  EXPECT_FALSE(drift.MovesAlong(std::nullopt)) << "nobody knows how the vehicle moved";
}

TEST(PlaceDriftTest, AFullTurnIsNone) {
  PlaceDrift drift((PlaceDriftOptions()));
  EXPECT_TRUE(drift.MovesAlong(Eigen::Vector4d(0.0, 0.0, 0.0, 2.0 * std::numbers::pi)));
}

TEST(PlaceDriftTest, WhereAVehicleIsCarriedAPlaceStaysAsFarOffAsItWas) {
  PlaceDrift drift((PlaceDriftOptions()));
  EXPECT_TRUE(drift.StaysOff({3.0, 0.0, 0.0, 0.0})) << "the first scan says how far";
  EXPECT_TRUE(drift.StaysOff({3.3, 0.2, 0.0, 0.0}));
  EXPECT_FALSE(drift.StaysOff({4.0, 0.0, 0.0, 0.0}));
  EXPECT_TRUE(drift.StaysOff({4.1, 0.0, 0.0, 0.0})) << "of where it went to";
  drift.EndCarry();
  EXPECT_TRUE(drift.StaysOff({9.0, 0.0, 0.0, 0.0}));
}

}  // namespace
}  // namespace atlas
