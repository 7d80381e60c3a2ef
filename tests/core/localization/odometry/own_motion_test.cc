// How a vehicle moves from scan to scan, wherever it is.
#include "core/localization/odometry/own_motion.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::kDegree;
using testing::UprightPose;

ScanFeatures Seen(const Pose& truth) {
  return ExtractFeatures(CastLeveledScan(testing::QuickSensor(), testing::Street(), truth),
                         testing::QuickOptions().features);
}

// In a bend, on a slope; heading the way it goes, or the other one.
Pose OnStreet(double x_m, double heading_rad) {
  return UprightPose({x_m, 0.4 * std::sin(0.2 * x_m), 1.8 + 0.01 * x_m},
                     heading_rad + 0.08 * std::cos(0.2 * x_m));
}

Pose StepBetween(const Pose& from, const Pose& to) {
  return from.inverse() * to;
}

TEST(OwnMotionTest, StepsAreTheVehiclesOwnWhereverItHeads) {
  for (const double heading_rad : {0.0, 3.0}) {
    OwnMotion own({}, {}, {});
    EXPECT_FALSE(own.is_begun());
    own.Begin(Seen(OnStreet(-10.0, heading_rad)));
    EXPECT_TRUE(own.is_begun());
    for (int i = 1; i <= 12; ++i) {
      const Pose before = OnStreet(-11.0 + i, heading_rad);
      const Pose now = OnStreet(-10.0 + i, heading_rad);
      const OwnStep step = own.Next(Seen(now), 1.0);
      ASSERT_TRUE(step.is_known) << i;
      const testing::PoseError error = ErrorOf(step.T_last_now, StepBetween(before, now));
      EXPECT_LT(error.horizontal_m, 0.08) << i;
      EXPECT_LT(error.vertical_m, 0.04) << i;
      EXPECT_LT(error.angle_rad, 0.5 * kDegree) << i;
      EXPECT_GT(step.covariance(0, 0), 0.0) << i;
    }
  }
}

TEST(OwnMotionTest, AScanThatIsMissingMakesAStepTwiceAsLong) {
  OwnMotion own({}, {}, {});
  own.Begin(Seen(OnStreet(-10.0, 0.0)));
  for (int i = 1; i <= 4; ++i) own.Next(Seen(OnStreet(-10.0 + i, 0.0)), 1.0);
  const OwnStep step = own.Next(Seen(OnStreet(-4.0, 0.0)), 2.0);
  ASSERT_TRUE(step.is_known);
  EXPECT_LT(
      ErrorOf(step.T_last_now, StepBetween(OnStreet(-6.0, 0.0), OnStreet(-4.0, 0.0))).horizontal_m,
      0.08);
}

TEST(OwnMotionTest, WhoWasMovedBeginsAnew) {
  OwnMotion own({}, {}, {});
  own.Begin(Seen(OnStreet(-16.0, 0.0)));
  own.Next(Seen(OnStreet(-15.0, 0.0)), 1.0);
  EXPECT_FALSE(own.Next(Seen(OnStreet(12.0, 1.5)), 1.0).is_known);
  EXPECT_TRUE(own.is_begun());
  const OwnStep step = own.Next(Seen(OnStreet(12.3, 1.5)), 1.0);
  ASSERT_TRUE(step.is_known);
  EXPECT_LT(
      ErrorOf(step.T_last_now, StepBetween(OnStreet(12.0, 1.5), OnStreet(12.3, 1.5))).horizontal_m,
      0.08);
  own.Forget();
  EXPECT_FALSE(own.is_begun());
}

}  // namespace
}  // namespace atlas
