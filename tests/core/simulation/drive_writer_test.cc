// The folder layout, byte for byte, and folders that cannot be written.
#include "core/simulation/drive_writer.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/scan/position_file.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

std::string ReadAll(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

SimulatedDrive ShortDrive() {
  DriveOptions options;
  options.spacing_m = 60.0;
  options.sensor.columns = 90;
  return SimulatedDrive::Create(MakeStreetWorld(), options).value();
}

class DriveWriterTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "drive_writer_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
};

TEST_F(DriveWriterTest, WritesWhatTheDriveHolds) {
  const SimulatedDrive drive = ShortDrive();
  ASSERT_EQ(drive.scans(), 4U);
  std::size_t reported = 0;
  const Status status = WriteDrive(drive, folder_ / "new" / "drive", [&](std::size_t done) {
    reported = done;
    return Status();
  });
  ASSERT_TRUE(status.ok()) << status.message();
  EXPECT_EQ(reported, drive.scans());
  const SimulatedScan scan = drive.Scan(2);
  const std::string points = ReadAll(folder_ / "new/drive/velodyne/000002.bin");
  ASSERT_EQ(points.size(), scan.points.size() * 16);
  EXPECT_EQ(std::memcmp(points.data(), scan.points.data(), points.size()), 0);
  EXPECT_EQ(ReadAll(folder_ / "new/drive/labels/000002.label").size(), scan.labels.size() * 4);
  EXPECT_FALSE(fs::exists(folder_ / "new/drive.partial"));
}

TEST_F(DriveWriterTest, APartIsNumberedFromZeroAndMayDrift) {
  const SimulatedDrive drive = ShortDrive();
  ASSERT_GE(drive.scans(), 3U);
  ASSERT_TRUE(WriteDrive(drive, folder_ / "whole", {}).ok());
  DriveWriteOptions options;
  options.begin = 1;
  options.end = 3;
  options.drift.emplace();
  ASSERT_TRUE(WriteDrive(drive, folder_ / "part", {}, options).ok());
  EXPECT_EQ(ReadAll(folder_ / "part/velodyne/000001.bin"),
            ReadAll(folder_ / "whole/velodyne/000002.bin"));
  EXPECT_FALSE(fs::exists(folder_ / "part/velodyne/000002.bin"));
  std::istringstream whole(ReadAll(folder_ / "whole/poses.txt"));
  std::istringstream truth(ReadAll(folder_ / "part/truth.txt"));
  std::istringstream poses(ReadAll(folder_ / "part/poses.txt"));
  std::string line;
  std::string true_line;
  std::string drifted;
  std::getline(whole, line);
  for (int i = 0; i < 2; ++i) {
    std::getline(whole, line);
    std::getline(truth, true_line);
    std::getline(poses, drifted);
    EXPECT_EQ(true_line, line);
    EXPECT_NE(drifted, line);
  }
  EXPECT_FALSE(std::getline(truth, true_line));
}

// Of the true poses, numbered as the scans are.
TEST_F(DriveWriterTest, PositionsAreOfTheTruth) {
  DriveWriteOptions options;
  options.begin = 1;
  options.drift.emplace();
  options.gnss.emplace().sigma_m = 0.001;
  const SimulatedDrive drive = ShortDrive();
  ASSERT_TRUE(WriteDrive(drive, folder_ / "part", {}, options).ok());
  const auto folder = OpenDriveFolder(folder_ / "part");
  ASSERT_TRUE(folder) << folder.error().message();
  const auto places = ReadPositions(folder_ / "part/positions.txt", *folder);
  ASSERT_TRUE(places) << places.error().message();
  ASSERT_EQ(places->size(), 3U);
  for (const auto& [number, place] : *places) {
    EXPECT_LT((place.p_world - drive.sensor_pose(number + 1).translation()).norm(), 0.01);
    EXPECT_EQ(place.radius_m, 0.001);
  }
  options.gnss->sigma_m = 0.0;
  EXPECT_EQ(WriteDrive(drive, folder_ / "none", {}, options).code(), StatusCode::kInvalidArgument);
  ASSERT_TRUE(WriteDrive(drive, folder_ / "without", {}).ok());
  EXPECT_FALSE(fs::exists(folder_ / "without/positions.txt"));
}

TEST_F(DriveWriterTest, APartThatIsNoneIsRefused) {
  const SimulatedDrive drive = ShortDrive();
  for (const auto& [begin, end] : {std::pair<std::size_t, std::size_t>{2, 2}, {999, SIZE_MAX}}) {
    DriveWriteOptions options;
    options.begin = begin;
    options.end = end;
    EXPECT_EQ(WriteDrive(drive, folder_ / "none", {}, options).code(),
              StatusCode::kInvalidArgument);
    EXPECT_FALSE(fs::exists(folder_ / "none"));
  }
}

TEST_F(DriveWriterTest, WhatOthersHaveBesideItStays) {
  const fs::path theirs = folder_ / "drive.partial";
  fs::create_directory(theirs);
  std::ofstream(theirs / "precious") << "notes";
  std::ofstream(folder_ / "drive.partial1") << "a file";
  ASSERT_TRUE(WriteDrive(ShortDrive(), folder_ / "drive", {}).ok());
  EXPECT_EQ(ReadAll(theirs / "precious"), "notes");
  EXPECT_EQ(ReadAll(folder_ / "drive.partial1"), "a file");
  EXPECT_TRUE(fs::exists(folder_ / "drive/poses.txt"));
  EXPECT_FALSE(fs::exists(folder_ / "drive.partial2"));
}

TEST_F(DriveWriterTest, PosesReadBackExactly) {
  const SimulatedDrive drive = ShortDrive();
  ASSERT_TRUE(WriteDrive(drive, folder_ / "drive/", {}).ok());
  std::ifstream poses(folder_ / "drive/poses.txt");
  std::ifstream times(folder_ / "drive/times.txt");
  for (std::size_t i = 0; i < drive.scans(); ++i) {
    std::array<double, 12> numbers{};
    for (double& number : numbers) {
      poses >> number;
    }
    const auto pose = PoseFromRowMajor(numbers);
    ASSERT_TRUE(pose.has_value());
    EXPECT_LT((pose->matrix() - drive.sensor_pose(i).matrix()).norm(), 1e-9);
    double time_s = -1.0;
    times >> time_s;
    EXPECT_DOUBLE_EQ(time_s, drive.time_s(i));
  }
  std::string rest;
  EXPECT_FALSE(poses >> rest);
}

TEST_F(DriveWriterTest, WritesALineForEachBox) {
  const SimulatedDrive drive = ShortDrive();
  ASSERT_TRUE(WriteDrive(drive, folder_ / "drive", {}).ok());
  std::ifstream boxes(folder_ / "drive/boxes.txt");
  std::string line;
  for (std::size_t i = 0; i < drive.scans(); ++i) {
    for (const TruthBox& box : drive.moving_boxes(i)) {
      ASSERT_TRUE(std::getline(boxes, line));
      std::istringstream words(line);
      std::size_t scan = 0;
      std::uint32_t label = 0;
      double number = 0.0;
      ASSERT_TRUE(words >> scan >> label);
      EXPECT_EQ(scan, i);
      EXPECT_EQ(label, box.label);
      int numbers = 0;
      while (words >> number) ++numbers;
      EXPECT_EQ(numbers, 15);
      EXPECT_DOUBLE_EQ(number, box.size_m.z());
    }
  }
  EXPECT_FALSE(std::getline(boxes, line));
}

TEST_F(DriveWriterTest, RefusesAFolderThatHoldsSomething) {
  std::ofstream(folder_ / "note.txt") << "mine";
  const Status status = WriteDrive(ShortDrive(), folder_, {});
  EXPECT_EQ(status.code(), StatusCode::kConflict);
  EXPECT_EQ(ReadAll(folder_ / "note.txt"), "mine");
}

TEST_F(DriveWriterTest, AScanThatSeesNothingIsATypedErrorThatLeavesNothing) {
  TrajectoryWorld world;
  world.still = std::make_shared<const MeshWorld>(TriangleMesh());
  const auto drive = SimulatedDrive::Create(std::move(world), {DriveMoment()}, {});
  const Status status = WriteDrive(*drive, folder_ / "drive", {});
  EXPECT_EQ(status.code(), StatusCode::kInvalidData);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(DriveWriterTest, AnErrorOfTheProgressEndsItAndLeavesNothing) {
  std::size_t calls = 0;
  const Status status = WriteDrive(ShortDrive(), folder_ / "drive", [&](std::size_t done) {
    ++calls;
    return done < 2 ? Status() : Status(StatusCode::kUnavailable, "signal 15");
  });
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_EQ(calls, 2U);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(DriveWriterTest, AFileInTheWayIsATypedErrorThatLeavesNothing) {
  std::ofstream(folder_ / "file") << "mine";
  const Status status = WriteDrive(ShortDrive(), folder_ / "file" / "drive", {});
  EXPECT_FALSE(status.ok());
  EXPECT_NE(status.message().find("file/drive"), std::string::npos) << status.message();
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(DriveWriterTest, AnUnwritableFolderIsATypedError) {
  const Status status = WriteDrive(ShortDrive(), "/proc/drive", {});
  EXPECT_FALSE(status.ok());
  EXPECT_NE(status.message().find("/proc/drive"), std::string::npos) << status.message();
}

}  // namespace
}  // namespace atlas
