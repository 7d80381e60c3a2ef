// What a vehicle drove before a scan.
#include "core/keyframe/vehicle_trail.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/core/support/shape_world.h"

namespace atlas {
namespace {

using testing::UprightPose;

constexpr float kHeight_m = 1.8F;

SensorMount Mount() {
  return {kHeight_m, Eigen::Vector3d::UnitZ()};
}

TEST(VehicleTrailTest, IsAMetreApartForFiveMetresHoweverDenseThePosesAre) {
  for (const double step_m : {0.01, 0.3, 1.0, 1.7, 4.9}) {
    std::vector<Pose> poses;
    for (double x_m = 0.0; x_m < 20.0; x_m += step_m) {
      poses.push_back(UprightPose({3.0, x_m, 1.0}, std::numbers::pi / 2.0));
    }
    const auto trail = TrailBefore(poses, Mount());
    ASSERT_EQ(trail.size(), 5U) << step_m;
    for (std::size_t i = 0; i < trail.size(); ++i) {
      EXPECT_NEAR(trail[i].sensor_m.x(), -static_cast<double>(i + 1), 1e-3) << step_m;
      EXPECT_NEAR(trail[i].sensor_m.y(), 0.0, 1e-4);
      EXPECT_NEAR(trail[i].sensor_m.z(), 0.0, 1e-4);
      EXPECT_NEAR(trail[i].ahead.x(), 1.0, 1e-4);
      EXPECT_NEAR(trail[i].GroundAt(-3.0F, 0.5F, kHeight_m), -kHeight_m, 1e-4);
    }
  }
}

TEST(VehicleTrailTest, FollowsBendsAndSlopes) {
  // Around a circle of 6 m, up at 0.2: the sensor is at a right angle to the ramp.
  constexpr double kRadius_m = 6.0;
  constexpr double kSlope = 0.2;
  std::vector<Pose> poses;
  for (int i = 0; i <= 20; ++i) {
    const double turn = 0.1 * i;
    Pose pose = UprightPose(
        {kRadius_m * std::sin(turn), kRadius_m * (1.0 - std::cos(turn)), kSlope * kRadius_m * turn},
        turn);
    pose.rotate(Eigen::AngleAxisd(-std::atan(kSlope), Eigen::Vector3d::UnitY()));
    poses.push_back(pose);
  }
  const Pose& now = poses.back();
  for (const VehiclePlace& place : TrailBefore(poses, Mount())) {
    const Eigen::Vector3d world =
        now.translation() +
        Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ()) * place.sensor_m.cast<double>();
    EXPECT_NEAR(std::hypot(world.x(), world.y() - kRadius_m), kRadius_m, 0.01);
    const double turn = std::atan2(world.x(), kRadius_m - world.y());
    EXPECT_NEAR(world.z(), kSlope * kRadius_m * turn, 0.01);
    EXPECT_NEAR(place.ahead.x(), std::cos(turn - 2.0), 0.01);
    EXPECT_NEAR(place.ahead.y(), std::sin(turn - 2.0), 0.01);
    // A metre ahead the ground is 0.2 m higher.
    const Eigen::Vector2f here = place.sensor_m.head<2>();
    const Eigen::Vector2f ahead = here + place.ahead;
    EXPECT_NEAR(place.GroundAt(ahead.x(), ahead.y(), kHeight_m) -
                    place.GroundAt(here.x(), here.y(), kHeight_m),
                kSlope, 0.01);
  }
}

TEST(VehicleTrailTest, EndsAtAJumpAndWhereTheDriveBegins) {
  EXPECT_TRUE(TrailBefore({}, Mount()).empty());
  std::vector<Pose> poses(3, UprightPose({0.0, 0.0, 0.0}, 0.0));
  EXPECT_TRUE(TrailBefore(poses, Mount()).empty());  // it stands still
  poses.push_back(UprightPose({2.0, 0.0, 0.0}, 0.0));
  EXPECT_EQ(TrailBefore(poses, Mount()).size(), 2U);
  poses.push_back(UprightPose({7.5, 0.0, 0.0}, 0.0));
  EXPECT_TRUE(TrailBefore(poses, Mount()).empty());
  poses.push_back(UprightPose({9.5, 0.0, 0.0}, 0.0));
  EXPECT_EQ(TrailBefore(poses, Mount()).size(), 2U);
}

}  // namespace
}  // namespace atlas
