#include "core/geometry/pose.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

Eigen::Quaterniond RandomRotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
      .normalized();
}

Pose MakePose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& position) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation.toRotationMatrix();
  pose.translation() = position;
  return pose;
}

TEST(PoseTest, QuantisationLosesNanometresAndNanoradians) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> position(-5e4, 5e4);
  for (int i = 0; i < 1'000; ++i) {
    const Eigen::Vector3d t(position(random), position(random), 0.01 * position(random));
    const Pose pose = MakePose(RandomRotation(random), t);
    const QuantizedPose quantized = QuantizedPose::FromPose(pose);
    EXPECT_TRUE(quantized.Validate().ok());
    EXPECT_GE(quantized.quaternion[0], 0);
    const Pose back = quantized.ToPose();
    EXPECT_LT((back.translation() - t).norm(), 1e-6);
    EXPECT_LT((back.linear() - pose.linear()).cwiseAbs().maxCoeff(), 5e-9);
    EXPECT_EQ(QuantizedPose::FromPose(back).x_um, quantized.x_um);
  }
}

TEST(PoseTest, RowMajorReadsBack) {
  std::mt19937 random(8);
  const Pose pose = MakePose(RandomRotation(random), {1.0, -2.0, 3.0});
  const Pose back = PoseFromRowMajor(PoseToRowMajor(pose)).value();
  EXPECT_LT((back.matrix() - pose.matrix()).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(PoseTest, RefusesWhatIsNoPose) {
  std::array<double, 12> values = PoseToRowMajor(Pose::Identity());
  const auto refused = [&](std::size_t index, double value) {
    std::array<double, 12> bad = values;
    bad[index] = value;
    const auto result = PoseFromRowMajor(bad);
    return !result && result.error().code() == StatusCode::kInvalidData;
  };
  EXPECT_TRUE(refused(0, 1.1));   // not a rotation
  EXPECT_TRUE(refused(0, -1.0));  // a mirror
  EXPECT_TRUE(refused(3, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_TRUE(refused(3, 2e7));
  EXPECT_TRUE(refused(11, 2.1e4));
  EXPECT_FALSE(refused(3, 9.9e6));
}

TEST(PoseTest, ValidateRefusesQuaternionsThatAreNotUnit) {
  QuantizedPose pose;
  EXPECT_TRUE(pose.Validate().ok());
  pose.quaternion[0] -= 10'000;
  EXPECT_FALSE(pose.Validate().ok());
  pose = {};
  pose.z_um = 20'001'000'000;
  EXPECT_FALSE(pose.Validate().ok());
}

TEST(PoseTest, YawAndLevelMultiplyToTheRotation) {
  std::mt19937 random(9);
  for (int i = 0; i < 1'000; ++i) {
    const Eigen::Quaterniond rotation = RandomRotation(random);
    const YawAndLevel split = SplitYaw(rotation);
    const Eigen::AngleAxisd yaw(split.yaw_rad, Eigen::Vector3d::UnitZ());
    EXPECT_LT((yaw * split.R_level_sensor).angularDistance(rotation), 1e-9);
    EXPECT_NEAR(split.R_level_sensor.z(), 0.0, 1e-12);  // no turn about the vertical
  }
}

TEST(PoseTest, AnUpsideDownSensorHasALevelToo) {
  const Eigen::Quaterniond flipped(0.0, 1.0, 0.0, 0.0);
  const YawAndLevel split = SplitYaw(flipped);
  EXPECT_EQ(split.yaw_rad, 0.0);
  EXPECT_LT(split.R_level_sensor.angularDistance(flipped), 1e-9);
}

}  // namespace
}  // namespace atlas
