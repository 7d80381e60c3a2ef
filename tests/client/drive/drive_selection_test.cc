#include "client/drive/drive_selection.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "client/score/segmentation_score.h"

namespace atlas {
namespace {

// Scans at these places along x, numbered from 0.
DriveFolder Along(const std::vector<double>& x_m) {
  DriveFolder drive;
  for (const double x : x_m) {
    DriveScan scan;
    scan.number = static_cast<std::uint32_t>(drive.scans.size());
    scan.T_world_sensor.translation().x() = x;
    drive.scans.push_back(scan);
  }
  return drive;
}

std::vector<std::size_t> Indices(const std::vector<SelectedScan>& selected) {
  std::vector<std::size_t> indices;
  indices.reserve(selected.size());
  for (const SelectedScan& scan : selected) {
    indices.push_back(scan.index);
  }
  return indices;
}

using Expected = std::vector<std::size_t>;

TEST(DriveSelectionTest, EveryIsMeasuredFromTheLastKeptPose) {
  const DriveFolder drive = Along({0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4});
  EXPECT_EQ(Indices(SelectScans(drive, {.every_m = 1.0})), (Expected{0, 3, 6}));
  EXPECT_EQ(Indices(SelectScans(drive, {.every_m = 0.0})).size(), 7U);
}

TEST(DriveSelectionTest, ParityAndRangeComeBeforeEvery) {
  const DriveFolder drive = Along({0, 0.6, 1.2, 1.8, 2.4, 3.0, 3.6});
  EXPECT_EQ(Indices(SelectScans(drive, {.parity = ScanParity::kOdd, .every_m = 1.0})),
            (Expected{1, 3, 5}));
  EXPECT_EQ(Indices(SelectScans(drive, {.begin = 2, .end = 5})), (Expected{2, 3, 4}));
}

TEST(DriveSelectionTest, JumpStartsAnotherSessionWhateverIsSelected) {
  const DriveFolder drive = Along({0, 1, 50, 51, 200});
  const auto all = SelectScans(drive, {});
  ASSERT_EQ(all.size(), 5U);
  EXPECT_EQ(all[1].session_part, 1U);
  EXPECT_EQ(all[2].session_part, 2U);
  EXPECT_EQ(all[4].session_part, 3U);
  const auto late = SelectScans(drive, {.begin = 3});
  EXPECT_EQ(late.front().session_part, 2U);
  EXPECT_DOUBLE_EQ(SelectedMetres(drive, all), 2.0);
  EXPECT_EQ(SessionPartName("drive", 1), "drive");
  EXPECT_EQ(SessionPartName("drive", 3), "drive.3");
}

TEST(DriveSelectionTest, ShuffleIsASeededPermutation) {
  auto a = SelectScans(Along(std::vector<double>(100, 0.0)), {});
  auto b = a;
  auto c = a;
  ShuffleScans(a, 7);
  ShuffleScans(b, 7);
  ShuffleScans(c, 8);
  EXPECT_EQ(Indices(a), Indices(b));
  EXPECT_NE(Indices(a), Indices(c));
  auto sorted = Indices(a);
  EXPECT_FALSE(std::is_sorted(sorted.begin(), sorted.end()));
  EXPECT_EQ(std::set<std::size_t>(sorted.begin(), sorted.end()).size(), 100U);
}

TEST(SegmentationScoreTest, CountsTheProtocolsClasses) {
  SegmentationCounts counts;
  const Eigen::Vector3f near(10, 0, 0);
  CountReturn(near, 40, true, counts);
  CountReturn(near, 0x00050000U + 48, true, counts);  // an instance in the upper bits
  CountReturn(near, 72, false, counts);
  CountReturn(near, 50, true, counts);
  CountReturn(near, 50, false, counts);
  CountReturn(near, 70, true, counts);                      // vegetation: ignored
  CountReturn(Eigen::Vector3f(2, 0, 0), 40, true, counts);  // too near
  CountReturn(Eigen::Vector3f(81, 0, 0), 40, true, counts);
  EXPECT_EQ(counts.true_ground, 2U);
  EXPECT_EQ(counts.false_ground, 1U);
  EXPECT_EQ(counts.missed_ground, 1U);
  SegmentationScore score;
  score.Add(counts);
  EXPECT_DOUBLE_EQ(score.precision(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(score.recall(), 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(score.f1(), 2.0 / 3.0);
}

}  // namespace
}  // namespace atlas
