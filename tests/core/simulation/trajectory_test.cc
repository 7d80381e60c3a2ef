// Poses thinned, timed and cut.
#include "core/simulation/trajectory.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

std::vector<Pose> Line(double from_m, double step_m, int count) {
  std::vector<Pose> poses(static_cast<std::size_t>(count), Pose::Identity());
  for (int i = 0; i < count; ++i) {
    poses[static_cast<std::size_t>(i)].translation().x() = from_m + step_m * i;
  }
  return poses;
}

TEST(TrajectoryTest, KeepsEveryPoseWithItsTimeAndPlace) {
  const auto trajectory = PlanTrajectory(Line(3.0, 0.5, 11), {});
  ASSERT_TRUE(trajectory.has_value());
  ASSERT_EQ(trajectory->moments.size(), 11U);
  EXPECT_NEAR(trajectory->moments[10].along_m, 5.0, 1e-9);
  EXPECT_NEAR(trajectory->moments[10].leg_time_s, 1.0, 1e-9);
  ASSERT_EQ(trajectory->legs.size(), 1U);
  EXPECT_EQ(trajectory->legs[0].size(), 6U);
}

TEST(TrajectoryTest, ThinningKeepsTimesAndTheWay) {
  TrajectoryOptions options;
  options.every_m = 2.0;
  const auto thin = PlanTrajectory(Line(0.0, 0.5, 11), options);
  ASSERT_EQ(thin->moments.size(), 3U);
  EXPECT_NEAR(thin->moments[1].leg_time_s, 0.4, 1e-9);
  EXPECT_EQ(thin->legs[0].size(), 6U);
}

TEST(TrajectoryTest, AJumpBeginsALeg) {
  std::vector<Pose> poses = Line(0.0, 1.0, 5);
  const std::vector<Pose> later = Line(500.0, 1.0, 5);
  poses.insert(poses.end(), later.begin(), later.end());
  const auto trajectory = PlanTrajectory(poses, {});
  ASSERT_EQ(trajectory->legs.size(), 2U);
  EXPECT_EQ(trajectory->moments[5].leg, 1U);
  EXPECT_EQ(trajectory->moments[5].along_m, 0.0);
  EXPECT_EQ(trajectory->moments[5].leg_time_s, 0.0);
}

TEST(TrajectoryTest, RefusesNothingAndNonsense) {
  EXPECT_EQ(PlanTrajectory({}, {}).error().code(), StatusCode::kInvalidData);
  TrajectoryOptions options;
  options.every_m = -1.0;
  EXPECT_EQ(PlanTrajectory(Line(0.0, 1.0, 2), options).error().code(),
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
