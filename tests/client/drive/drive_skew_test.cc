// Simulated drives are exact snapshots, or as a sensor saw them that turned while it moved. Which
// is which is told by the scans and the poses alone.
#include "client/drive/drive_skew.h"

#include <filesystem>
#include <iostream>
#include <string>

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
    Write("street", "street", 0.0);
    Write("overpass", "overpass", 0.0);
    Write("street_skewed", "street", DriveOptions().scan_interval_s);
  }
  static void Write(const std::string& name, const std::string& world, double revolution_s) {
    DriveOptions options;
    options.sensor = *LidarSensorByName("h350");
    options.revolution_s = revolution_s;
    const auto drive = SimulatedDrive::Create(MakeWorld(*WorldKindByName(world)).value(), options);
    ASSERT_TRUE(drive) << drive.error().message();
    ASSERT_TRUE(WriteDrive(*drive, root / name, {}).ok());
  }
  static void TearDownTestSuite() { fs::remove_all(root); }

  static DeskewDecision Decide(const std::string& name, Deskewing deskewing) {
    const DriveFolder drive = OpenDriveFolder(root / name).value();
    const DriveSurvey survey = SurveySensor(drive, {}).value();
    const auto decision = DecideDeskewing(deskewing, drive, survey, DriveMotion(drive));
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
  const auto skew = FindSkew(drive, SurveySensor(drive, {}).value(), DriveMotion(drive));
  ASSERT_TRUE(skew.has_value());
  EXPECT_EQ(skew->windows, 0U);
  EXPECT_FALSE(skew->is_skewed);
}

}  // namespace
}  // namespace atlas
