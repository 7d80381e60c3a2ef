#include "core/scan/drive_folder.h"

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "core/base/bytes.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIdentity = "1 0 0 0 0 1 0 0 0 0 1 0\n";

class DriveFolderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("drive_folder_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "velodyne");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void Write(const std::string& name, const std::string& content) {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << content;
  }

  static std::string Returns(std::initializer_list<float> values) {
    ByteWriter out;
    for (const float value : values) {
      out.U32(std::bit_cast<std::uint32_t>(value));
    }
    return {out.bytes().begin(), out.bytes().end()};
  }

  fs::path folder_;
};

TEST_F(DriveFolderTest, ScansBelongToTheLineOfTheirNumber) {
  Write("velodyne/000002.bin", Returns({1, 2, 3, 0}));
  Write("velodyne/000000.bin", Returns({1, 2, 3, 0}));
  Write("velodyne/notes.txt", "not a scan");
  Write("poses.txt", std::string(kIdentity) + kIdentity + "1 0 0 7 0 1 0 8 0 0 1 9\n");
  Write("times.txt", "0.0\n0.1\n0.25\n");
  Write("labels/000002.label", std::string(4, '\0'));
  const Result<DriveFolder> drive = OpenDriveFolder(folder_);
  ASSERT_TRUE(drive.has_value()) << drive.error().message();
  ASSERT_EQ(drive->scans.size(), 2U);
  EXPECT_EQ(drive->scans[1].number, 2U);
  EXPECT_EQ(drive->scans[1].T_world_sensor.translation(), Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(drive->scans[1].time_s, 0.25);
  EXPECT_TRUE(drive->scans[1].label.has_value());
  EXPECT_FALSE(drive->scans[0].label.has_value());
}

TEST_F(DriveFolderTest, BlankLinesAtTheEndAreNoPoses) {
  Write("poses.txt", std::string(kIdentity) + kIdentity + "\r\n  \t\n\n");
  const Result<std::vector<Pose>> poses = ReadPoses(folder_ / "poses.txt");
  ASSERT_TRUE(poses.has_value()) << poses.error().message();
  EXPECT_EQ(poses->size(), 2U);
}

TEST_F(DriveFolderTest, MissingAndShortFilesAreNamed) {
  EXPECT_EQ(OpenDriveFolder(folder_ / "nowhere").error().code(), StatusCode::kNotFound);
  EXPECT_EQ(OpenDriveFolder(folder_).error().code(), StatusCode::kInvalidData);  // no scan
  Write("velodyne/000001.bin", Returns({1, 2, 3, 0}));
  const Result<DriveFolder> without_poses = OpenDriveFolder(folder_);
  EXPECT_EQ(without_poses.error().code(), StatusCode::kNotFound);
  EXPECT_NE(without_poses.error().message().find("poses.txt"), std::string::npos);
  Write("poses.txt", kIdentity);
  EXPECT_EQ(OpenDriveFolder(folder_).error().code(), StatusCode::kInvalidData);
}

TEST_F(DriveFolderTest, BadPoseLinesAreNamed) {
  for (const char* line :
       {"1 0 0 0 0 1 0 0 0 0 1", "1 0 0-5 0 1 0 0 0 0 1 0", "1 0 0 0 0 1 0 0 0 0 1 x",
        "1 0 0 0 0 1 0 0 0 0 1 nan", "2 0 0 0 0 2 0 0 0 0 2 0", "1 0 0 0 0 1 0 0 0 0 -1 0",
        "1 0 0 1e12 0 1 0 0 0 0 1 0"}) {
    Write("poses.txt", std::string(kIdentity) + line + "\n");
    const Result<std::vector<Pose>> poses = ReadPoses(folder_ / "poses.txt");
    ASSERT_FALSE(poses.has_value()) << line;
    EXPECT_EQ(poses.error().code(), StatusCode::kInvalidData) << line;
    EXPECT_NE(poses.error().message().find("line 2"), std::string::npos) << poses.error().message();
  }
}

TEST_F(DriveFolderTest, BadScansAreRefused) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(ParseScan({}).error().code(), StatusCode::kInvalidData);
  for (const std::string& content :
       {Returns({1, 2, 3}), Returns({1, 2, nan, 0}), Returns({1, 2e6F, 3, 0})}) {
    Write("velodyne/000000.bin", content);
    const Result<PointCloud> cloud = ReadScan(folder_ / "velodyne/000000.bin");
    ASSERT_FALSE(cloud.has_value());
    EXPECT_EQ(cloud.error().code(), StatusCode::kInvalidData);
    EXPECT_NE(cloud.error().message().find("000000.bin"), std::string::npos);
  }
  // Intensity is not believed: any bits will do.
  Write("velodyne/000000.bin", Returns({1, 2, 3, nan}));
  EXPECT_TRUE(ReadScan(folder_ / "velodyne/000000.bin").has_value());
}

TEST_F(DriveFolderTest, TwoScansOfOneNumberAreRefused) {
  Write("velodyne/000000.bin", Returns({1, 2, 3, 0}));
  Write("velodyne/0.bin", Returns({1, 2, 3, 0}));
  Write("poses.txt", kIdentity);
  const Result<DriveFolder> drive = OpenDriveFolder(folder_);
  ASSERT_FALSE(drive.has_value());
  EXPECT_EQ(drive.error().code(), StatusCode::kInvalidData);
}

TEST_F(DriveFolderTest, AFolderInPlaceOfAFileIsInvalidData) {
  fs::create_directories(folder_ / "velodyne/000000.bin");
  EXPECT_EQ(ReadScan(folder_ / "velodyne/000000.bin").error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(ReadScan(folder_ / "velodyne/000001.bin").error().code(), StatusCode::kNotFound);
}

TEST_F(DriveFolderTest, LabelsMustCoverEveryReturn) {
  Write("labels/000000.label", std::string(8, '\0'));
  PointCloud cloud;
  cloud.points.resize(2);
  EXPECT_TRUE(ReadLabels(folder_ / "labels/000000.label", cloud).has_value());
  cloud.points.resize(3);
  EXPECT_EQ(ReadLabels(folder_ / "labels/000000.label", cloud).error().code(),
            StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
