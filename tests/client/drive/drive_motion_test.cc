// What a recorded drive's poses and times say of a revolution.
#include "client/drive/drive_motion.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

// A metre each 0.1 s; of the scans that were made these are there, numbered
// one behind the other.
DriveFolder DriveOf(const std::vector<int>& made, bool has_times = true) {
  DriveFolder drive;
  for (const int i : made) {
    DriveScan& scan = drive.scans.emplace_back();
    scan.number = static_cast<std::uint32_t>(drive.scans.size() - 1);
    scan.T_world_sensor.translation().x() = 1.0 * i;
    if (has_times) scan.time_s = 100.0 + 0.1 * i;
  }
  return drive;
}

double MetresDuring(const DriveFolder& drive, std::size_t index) {
  return DriveMotion(drive).During(index).translation().x();
}

TEST(DriveMotionTest, IsThatToTheNextScan) {
  const DriveFolder drive = DriveOf({0, 1, 2, 3});
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(MetresDuring(drive, i), 1.0, 1e-9) << i;
  }
  EXPECT_EQ(MetresDuring(DriveOf({0}), 0), 0.0);
}

TEST(DriveMotionTest, OfAGapItIsOneRevolution) {
  const DriveFolder drive = DriveOf({0, 1, 2, 5, 6, 8, 9});
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    EXPECT_NEAR(MetresDuring(drive, i), 1.0, 1e-9) << i;
  }
  EXPECT_NEAR(MetresDuring(DriveOf({0, 1, 2, 5, 6}, false), 2), 3.0, 1e-9) << "nobody knows";
}

TEST(DriveMotionTest, WhoKnowsTheRevolutionIsBelieved) {
  const DriveFolder drive = DriveOf({0, 4, 8, 12, 21});
  EXPECT_NEAR(MetresDuring(drive, 0), 4.0, 1e-9);
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    EXPECT_NEAR(DriveMotion(drive, 0.1).During(i).translation().x(), 1.0, 1e-9) << i;
  }
}

// As where a drive keeps some of its scans' files, under the numbers that they had.
TEST(DriveMotionTest, AGapInTheNumbersIsOneInTheTimes) {
  DriveFolder drive = DriveOf({0, 1, 2, 5, 7, 8});
  for (DriveScan& scan : drive.scans) {
    scan.number = static_cast<std::uint32_t>(std::lround(scan.T_world_sensor.translation().x()));
  }
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    EXPECT_NEAR(MetresDuring(drive, i), 1.0, 1e-9) << i;
  }
  drive.scans.erase(drive.scans.begin() + 1);  // no two follow each other now but the last ones
  drive.scans.pop_back();
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    EXPECT_EQ(MetresDuring(drive, i), 0.0) << i << ": nobody knows";
    EXPECT_NEAR(DriveMotion(drive, 0.1).During(i).translation().x(), 1.0, 1e-9) << i;
  }
  for (DriveScan& scan : drive.scans) scan.time_s.reset();
  EXPECT_EQ(DriveMotion(drive, 0.1).During(1).translation().x(), 0.0) << "nor here";
}

TEST(DriveMotionTest, ATurnIsSharedToo) {
  DriveFolder drive = DriveOf({0, 1, 2, 4, 5});
  for (DriveScan& scan : drive.scans) {
    const double turned_rad = 0.1 * scan.T_world_sensor.translation().x();
    scan.T_world_sensor.linear() =
        Eigen::AngleAxisd(turned_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    const Pose during = DriveMotion(drive).During(i);
    EXPECT_NEAR(Eigen::AngleAxisd(during.linear()).angle(), 0.1, 1e-9) << i;
  }
}

TEST(DriveMotionTest, TimesThatAreTooCloseSayNothing) {
  DriveFolder drive = DriveOf({0, 1, 2, 3, 4, 5});
  drive.scans[2].time_s = *drive.scans[1].time_s + 0.001;
  EXPECT_NEAR(MetresDuring(drive, 1), 1.0, 1e-9);
}

}  // namespace
}  // namespace atlas
