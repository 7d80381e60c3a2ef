// The rings of recorded scans, however a driver may have stored them: with the same scan turned
// about the sensor (its rings then begin at another azimuth), its rings in the other order, each of
// them the other way around, every return lies in the same row.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>

#include "core/scan/drive_folder.h"
#include "core/scan/rings/ring_splitter.h"
#include "core/scan/scan_reader.h"
#include "core/scan/sensor_layout.h"

namespace atlas {
namespace {

constexpr std::size_t kScans = 4;
constexpr std::size_t kManyScans = 60;        // rows that are none add up over a drive
const EgoBox kNoVehicle{-1.0F, -1.0F, 0.0F};  // left out before the scan is turned

struct Storage {
  double turned_deg = 0.0;
  bool are_rings_reversed = false;
  bool is_turn_reversed = false;
};

struct Stored {
  PointCloud cloud;
  std::vector<int> row;  // of each return, as the recorded order has it
};

std::vector<PointCloud> ReadScans(const DriveFolder& drive, std::size_t most) {
  std::vector<PointCloud> clouds;
  const std::size_t count = std::min(most, drive.scans.size());
  for (std::size_t i = 0; i < count; ++i) {
    Result<PointCloud> cloud = ReadScan(drive.scans[i * drive.scans.size() / count].scan);
    EXPECT_TRUE(cloud) << cloud.error().message();
    clouds.push_back(cloud ? std::move(*cloud) : PointCloud());
  }
  return clouds;
}

Stored Store(const PointCloud& cloud, const SensorLayout& layout, const Storage& storage) {
  RingSplit split = SplitRings(cloud, layout.ego);
  std::vector<int> rows = AssignRows(split, layout.elevation_rad);
  const auto turn = Eigen::AngleAxisf(
      static_cast<float>(storage.turned_deg * std::numbers::pi / 180.0), Eigen::Vector3f::UnitZ());
  Stored stored;
  for (std::size_t k = 0; k < split.runs.size(); ++k) {
    const std::size_t at = storage.are_rings_reversed ? split.runs.size() - 1 - k : k;
    const RingRun& run = split.runs[at];
    for (std::uint32_t i = 0; i < run.size(); ++i) {
      const std::uint32_t from = storage.is_turn_reversed ? run.end - 1 - i : run.begin + i;
      stored.cloud.points.push_back(turn * cloud.points[split.index[from]]);
      stored.row.push_back(rows[at]);
    }
  }
  return stored;
}

// The share of the returns that are put into another row.
double Misplaced(const std::vector<PointCloud>& clouds,
                 const SensorLayout& layout,
                 const Storage& storage) {
  std::vector<Stored> scans;
  SensorLayoutEstimator estimator(kNoVehicle);
  for (const PointCloud& cloud : clouds) {
    scans.push_back(Store(cloud, layout, storage));
    estimator.Add(scans.back().cloud);
  }
  const Result<SensorLayout> found = estimator.Estimate();
  if (!found || found->channels() != layout.channels()) {
    return 1.0;
  }
  std::size_t misplaced = 0;
  std::size_t all = 0;
  for (const Stored& scan : scans) {
    const RingSplit split = SplitRings(scan.cloud, kNoVehicle);
    const std::vector<int> rows = AssignRows(split, found->elevation_rad);
    for (std::size_t k = 0; k < split.runs.size(); ++k) {
      for (std::uint32_t i = split.runs[k].begin; i < split.runs[k].end; ++i) {
        misplaced += static_cast<std::size_t>(rows[k] != scan.row[split.index[i]]);
        ++all;
      }
    }
  }
  return static_cast<double>(misplaced) / static_cast<double>(all);
}

// The returns of every so-many-th channel: as a sensor of fewer rings would have stored them.
PointCloud KeepRows(const PointCloud& cloud, const SensorLayout& layout, int step, int first) {
  const RingSplit split = SplitRings(cloud, layout.ego);
  const std::vector<int> rows = AssignRows(split, layout.elevation_rad);
  PointCloud kept;
  for (std::size_t k = 0; k < split.runs.size(); ++k) {
    for (std::uint32_t i = split.runs[k].begin; rows[k] % step == first && i < split.runs[k].end;
         ++i) {
      kept.points.push_back(cloud.points[split.index[i]]);
    }
  }
  return kept;
}

Result<SensorLayout> LayoutOf(const std::vector<PointCloud>& clouds) {
  SensorLayoutEstimator estimator;
  for (const PointCloud& cloud : clouds) {
    estimator.Add(cloud);
  }
  return estimator.Estimate();
}

class RingOrderTest : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const char* data = std::getenv("ATLAS_DATA");  // NOLINT(concurrency-mt-unsafe): one thread
    const std::filesystem::path folder =
        std::filesystem::path(data == nullptr ? "" : data) / GetParam();
    if (!std::filesystem::is_directory(folder)) {
      GTEST_SKIP() << GetParam() << " is not in $ATLAS_DATA";
    }
    Result<DriveFolder> drive = OpenDriveFolder(folder);
    ASSERT_TRUE(drive) << drive.error().message();
    drive_ = std::move(*drive);
  }

  DriveFolder drive_;
};

TEST_P(RingOrderTest, EverySoManyThRingIsASensorOfThatManyRings) {
  const std::vector<PointCloud> clouds = ReadScans(drive_, kManyScans);
  const Result<SensorLayout> layout = LayoutOf(clouds);
  ASSERT_TRUE(layout) << layout.error().message();
  for (int step = 2; layout->channels() / step >= 16; step *= 2) {
    for (int first = 0; first < step; ++first) {
      std::vector<PointCloud> kept;
      for (const PointCloud& cloud : clouds) {
        kept.push_back(KeepRows(cloud, *layout, step, first));
      }
      const Result<SensorLayout> found = LayoutOf(kept);
      ASSERT_TRUE(found) << found.error().message();
      EXPECT_EQ(found->channels(), layout->channels() / step) << "from ring " << first;
    }
  }
}

TEST_P(RingOrderTest, HowADriveIsStoredChangesNoRow) {
  const std::vector<PointCloud> clouds = ReadScans(drive_, kScans);
  const Result<SensorLayout> layout = LayoutOf(clouds);
  ASSERT_TRUE(layout) << layout.error().message();
  for (const double turned_deg : {0.0, 10.0, 45.0, 90.0, 180.0, 250.0, 350.0}) {
    for (int bits = 0; bits < 4; ++bits) {
      const Storage storage{turned_deg, (bits & 1) != 0, (bits & 2) != 0};
      EXPECT_LT(Misplaced(clouds, *layout, storage), 0.005)
          << turned_deg << " deg, rings reversed " << storage.are_rings_reversed
          << ", turn reversed " << storage.is_turn_reversed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Drives,
                         RingOrderTest,
                         ::testing::Values("semantickitti_mini/00",
                                           "semantickitti_mini/02",
                                           "semantickitti_mini/04",
                                           "semantickitti_mini/08",
                                           "kitti_0005",
                                           "sim_garage_A",
                                           "sim_overpass_A"));

}  // namespace
}  // namespace atlas
