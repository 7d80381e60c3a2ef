#include "client/drive/localization_trial.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;

Pose At(double x_m, double y_m, double z_m, double yaw_rad, double pitch_rad) {
  Pose pose = Pose::Identity();
  pose.linear() = (Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()))
                      .toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  return pose;
}

TEST(LocalizationTrialTest, TiltIsOffByExactlyTheImusError) {
  const Pose truth = At(5, 6, 7, 1.0, 15 * kDeg);
  const Eigen::Quaterniond exact = SplitYaw(Eigen::Quaterniond(truth.linear())).R_level_sensor;
  for (std::uint32_t trial = 0; trial < 50; ++trial) {
    const Eigen::Quaterniond level = DisturbedLevel(truth, 0.5 * kDeg, {1, 2, trial});
    const Eigen::Vector3d down = level.conjugate() * -Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d true_down = exact.conjugate() * -Eigen::Vector3d::UnitZ();
    EXPECT_NEAR(std::acos(down.dot(true_down)) / kDeg, 0.5, 1e-6);
    EXPECT_NEAR(SplitYaw(level).yaw_rad, 0.0, 1e-12);
  }
}

TEST(LocalizationTrialTest, StartsAreWithinTheirBoundsAndSpread) {
  const Pose truth = At(5, 6, 7, 1.0, 0.1);
  const Eigen::Quaterniond level = DisturbedLevel(truth, 0.5 * kDeg, {});
  double least_m = 1.0;
  double most_m = -1.0;
  for (std::uint32_t trial = 0; trial < 500; ++trial) {
    const Pose start = PerturbedStart(truth, level, 0.4, 1.5 * kDeg, {9, 3, trial});
    const Eigen::Vector3d offset = start.translation() - truth.translation();
    EXPECT_LE(offset.cwiseAbs().head<2>().maxCoeff(), 0.4);
    EXPECT_LE(std::abs(offset.z()), 0.2);
    const YawAndLevel split = SplitYaw(Eigen::Quaterniond(start.linear()));
    EXPECT_LE(std::abs(split.yaw_rad - 1.0), 1.5 * kDeg + 1e-9);
    EXPECT_NEAR(split.R_level_sensor.angularDistance(level), 0.0, 1e-7);
    least_m = std::min(least_m, offset.x());
    most_m = std::max(most_m, offset.x());
  }
  EXPECT_LT(least_m, -0.38);
  EXPECT_GT(most_m, 0.38);
}

TEST(LocalizationTrialTest, DrawsFollowTheirSeedAlone) {
  const Pose truth = At(0, 0, 0, 0, 0);
  const Eigen::Quaterniond level = Eigen::Quaterniond::Identity();
  const auto draw = [&](const TrialSeed& seed) -> Eigen::Vector3d {
    return PerturbedStart(truth, level, 1.0, 0.1, seed).translation();
  };
  EXPECT_EQ(draw({1, 2, 3}), draw({1, 2, 3}));
  EXPECT_NE(draw({1, 2, 3}), draw({2, 2, 3}));
  EXPECT_NE(draw({1, 2, 3}), draw({1, 3, 3}));
  EXPECT_NE(draw({1, 2, 3}), draw({1, 2, 4}));
}

}  // namespace
}  // namespace atlas
