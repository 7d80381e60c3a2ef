#include "core/scan/deskew.h"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

std::vector<Eigen::Vector3f> Deskewed(const std::vector<Eigen::Vector3f>& points,
                                      const Pose& motion) {
  RangeImage image;
  for (const Eigen::Vector3f& p : points) {
    image.x.push_back(p.x());
    image.y.push_back(p.y());
    image.z.push_back(p.z());
    image.source.push_back(static_cast<std::uint32_t>(image.source.size()));
  }
  Deskew(image, motion);
  std::vector<Eigen::Vector3f> result;
  for (std::size_t i = 0; i < image.size(); ++i) {
    result.emplace_back(image.x[i], image.y[i], image.z[i]);
  }
  return result;
}

Eigen::Vector3f Deskewed(const Eigen::Vector3f& point, const Pose& motion) {
  return Deskewed(std::vector{point}, motion).front();
}

Pose Motion(const Eigen::Vector3d& translation, double angle_rad, const Eigen::Vector3d& axis) {
  Pose motion = Pose::Identity();
  motion.translation() = translation;
  motion.linear() = Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
  return motion;
}

// A levelled scan is moved as its returns are in the sensor's own frame.
TEST(DeskewTest, ALevelledScanMovesAsItsReturnsDo) {
  const Eigen::Quaterniond R_level_sensor(
      Eigen::AngleAxisd(0.2, Eigen::Vector3d(1.0, -0.5, 0.0).normalized()));
  const Eigen::Matrix3f R = R_level_sensor.cast<float>().toRotationMatrix();
  const Pose motion = Motion({1.2, 0.1, -0.05}, 0.2, {0.1, 0.0, 1.0});
  const std::vector<Eigen::Vector3f> points = {
      {9.0F, 2.0F, -1.0F}, {-4.0F, 7.0F, 0.5F}, {-6.0F, -3.0F, 2.0F}, {0.5F, -12.0F, -1.5F}};
  LeveledScan scan;
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector3f level = R * p;
    scan.x.push_back(level.x());
    scan.y.push_back(level.y());
    scan.z.push_back(level.z());
  }
  scan.range_m.resize(points.size());
  scan.azimuth_rad.resize(points.size());
  Deskew(scan, R_level_sensor, motion);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f right = R * Deskewed(points[i], motion);
    EXPECT_NEAR(scan.x[i], right.x(), 1e-4) << i;
    EXPECT_NEAR(scan.y[i], right.y(), 1e-4) << i;
    EXPECT_NEAR(scan.z[i], right.z(), 1e-4) << i;
    EXPECT_NEAR(scan.range_m[i], std::hypot(right.x(), right.y()), 1e-4) << i;
    EXPECT_GE(scan.azimuth_rad[i], 0.0F) << i;
    EXPECT_NEAR(std::tan(scan.azimuth_rad[i]), right.y() / right.x(), 1e-2) << i;
  }
}

TEST(DeskewTest, AVehicleAtRestChangesNothing) {
  const Eigen::Vector3f point(3.0F, -20.0F, 1.5F);
  EXPECT_EQ(Deskewed(point, Pose::Identity()), point);
  EXPECT_TRUE(Deskewed(std::vector<Eigen::Vector3f>(), Pose::Identity()).empty());
}

TEST(DeskewTest, TheSensorTurnsClockwiseAndItsPoseIsThatOfLookingAhead) {
  // A metre ahead a revolution: what it saw on the left was a quarter of a metre before.
  const Pose ahead = Motion({1.0, 0.0, 0.0}, 0.0, Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(Deskewed({10.0F, 0.0F, 0.0F}, ahead).x(), 10.0F, 2e-3);
  EXPECT_NEAR(Deskewed({0.0F, 10.0F, 0.0F}, ahead).x(), -0.25F, 2e-3);
  EXPECT_NEAR(Deskewed({0.0F, -10.0F, 0.0F}, ahead).x(), 0.25F, 2e-3);
  EXPECT_NEAR(Deskewed({-10.0F, 0.01F, 0.0F}, ahead).x(), -10.5F, 2e-3);
  EXPECT_NEAR(Deskewed({-10.0F, -0.01F, 0.0F}, ahead).x(), -9.5F, 2e-3);
}

TEST(DeskewTest, AnyMotionIsUndoneToWithinAStep) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::uniform_real_distribution<double> range(2.0, 80.0);
  for (int round = 0; round < 10; ++round) {
    const Eigen::Vector3d axis(unit(random), unit(random), 3.0);
    const Eigen::Vector3d move(2.0 * unit(random), 0.3 * unit(random), 0.1 * unit(random));
    const double turn_rad = 0.1 * unit(random);
    std::vector<Eigen::Vector3f> points;
    std::vector<Eigen::Vector3d> truth;
    for (int i = 0; i < 200; ++i) {
      const double azimuth = std::numbers::pi * unit(random);
      const double r = range(random);
      const Eigen::Vector3d then(r * std::cos(azimuth), r * std::sin(azimuth), unit(random));
      const double share = -azimuth / (2.0 * std::numbers::pi);
      truth.emplace_back(Motion(share * move, share * turn_rad, axis) * then);
      points.emplace_back(then.cast<float>());
    }
    const auto result = Deskewed(points, Motion(move, turn_rad, axis));
    ASSERT_EQ(result.size(), points.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      // Half a step of 1024, by the way and by the turn at that range.
      const double step_m = (move.norm() + std::abs(turn_rad) * truth[i].norm()) / 2048.0 + 1e-4;
      EXPECT_LT((result[i].cast<double>() - truth[i]).norm(), step_m);
    }
  }
}

TEST(DeskewTest, ReturnsExactlyBehindTheVehicleAreInReach) {
  const Pose motion = Motion({1.0, 0.0, 0.0}, 0.05, Eigen::Vector3d::UnitZ());
  for (const float y : {0.0F, -0.0F, 1e-30F, -1e-30F}) {
    const Eigen::Vector3f p = Deskewed({-10.0F, y, 0.0F}, motion);
    EXPECT_TRUE(p.allFinite());
    EXPECT_LT((p - Eigen::Vector3f(-10.0F, 0.0F, 0.0F)).norm(), 0.8F);
  }
}

}  // namespace
}  // namespace atlas
