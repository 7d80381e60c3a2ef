// Simulated drives are exact snapshots; skewed copies of them are as a sensor saw them that turned
// while it moved. Which is which is told by the scans and the poses alone.
#include "client/drive/drive_skew.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "client/drive/drive_motion.h"
#include "core/simulation/drive_writer.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

class DriveSkewTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    root = fs::path(::testing::TempDir()) / ("atlas_skew." + std::to_string(getpid()));
    fs::remove_all(root);
    fs::create_directories(root);
    for (const std::string world : {"street", "overpass"}) {
      DriveOptions options;
      options.sensor = *LidarSensorByName("h350");
      const auto drive =
          SimulatedDrive::Create(MakeWorld(*WorldKindByName(world)).value(), options);
      ASSERT_TRUE(drive) << drive.error().message();
      ASSERT_TRUE(WriteDrive(*drive, root / world, {}).ok());
      WriteSkewed(root / world, root / (world + "_skewed"));
    }
  }
  static void TearDownTestSuite() { fs::remove_all(root); }

  // Each return where it lay when it was measured, the sensor clockwise and looking ahead at the
  // scan's pose.
  static void WriteSkewed(const fs::path& from, const fs::path& to) {
    fs::copy(from, to, fs::copy_options::recursive);
    const DriveFolder drive = OpenDriveFolder(from).value();
    for (std::size_t i = 0; i < drive.scans.size(); ++i) {
      const Pose motion = DriveMotion(drive).During(i);
      const Eigen::AngleAxisd turn(motion.linear());
      std::ifstream in(drive.scans[i].scan, std::ios::binary);
      std::ofstream out(to / "velodyne" / drive.scans[i].scan.filename(), std::ios::binary);
      std::array<float, 4> point{};
      while (in.read(reinterpret_cast<char*>(point.data()), sizeof(point))) {
        const double fraction = -std::atan2(point[1], point[0]) / (2.0 * std::numbers::pi);
        Pose T_now_then = Pose::Identity();
        T_now_then.linear() =
            Eigen::AngleAxisd(fraction * turn.angle(), turn.axis()).toRotationMatrix();
        T_now_then.translation() = fraction * motion.translation();
        const Eigen::Vector3d then =
            T_now_then.inverse() * Eigen::Vector3d(point[0], point[1], point[2]);
        const std::array<float, 4> skewed{static_cast<float>(then.x()),
                                          static_cast<float>(then.y()),
                                          static_cast<float>(then.z()), point[3]};
        out.write(reinterpret_cast<const char*>(skewed.data()), sizeof(skewed));
      }
    }
  }
  static DeskewDecision Decide(const std::string& name, Deskewing deskewing) {
    const DriveFolder drive = OpenDriveFolder(root / name).value();
    const DriveSurvey survey = SurveySensor(drive, {}).value();
    const auto decision = DecideDeskewing(deskewing, drive, survey);
    EXPECT_TRUE(decision.has_value());
    if (decision->skew) {
      std::cout << name << ": " << decision->skew->sharper << " sharper, "
                << decision->skew->windows << " windows" << std::endl;
    }
    return *decision;
  }

  static inline fs::path root;
};

TEST_F(DriveSkewTest, SnapshotsAreLeftAsTheyAre) {
  EXPECT_FALSE(Decide("street", Deskewing::kAuto).is_deskewed);
  EXPECT_FALSE(Decide("overpass", Deskewing::kAuto).is_deskewed);
}

TEST_F(DriveSkewTest, SkewedScansAreFoundOut) {
  EXPECT_TRUE(Decide("street_skewed", Deskewing::kAuto).is_deskewed);
}

TEST_F(DriveSkewTest, WhoSaysSoIsNotAsked) {
  const DeskewDecision on = Decide("street", Deskewing::kOn);
  EXPECT_TRUE(on.is_deskewed);
  EXPECT_FALSE(on.skew.has_value());
  EXPECT_FALSE(Decide("street_skewed", Deskewing::kOff).is_deskewed);
}

// What does not move is not skewed, whatever it is.
TEST_F(DriveSkewTest, ADriveThatStandsTellsNothing) {
  DriveFolder drive = OpenDriveFolder(root / "street").value();
  for (DriveScan& scan : drive.scans) {
    scan.T_world_sensor = drive.scans.front().T_world_sensor;
  }
  const auto skew = FindSkew(drive, SurveySensor(drive, {}).value());
  ASSERT_TRUE(skew.has_value());
  EXPECT_EQ(skew->windows, 0U);
  EXPECT_FALSE(skew->is_skewed);
}

}  // namespace
}  // namespace atlas
