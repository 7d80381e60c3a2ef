// A piece of a simulated street tracked in its own map, damaged on purpose: the benchmark in small.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/drive/drive_localization.h"
#include "core/scan/scan_reader.h"
#include "tests/bench/localization/fused_drive.h"
#include "tests/bench/localization/street_piece.h"
#include "tests/bench/monitoring/change_score.h"
#include "tests/bench/monitoring/damaged_map.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kFirstScan = 40;
constexpr std::size_t kScans = 24;

class MonitoringBenchTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    piece_ = std::make_unique<StreetPiece>("monitoring_bench_test", kFirstScan, kScans);
  }
  static void TearDownTestSuite() { piece_.reset(); }

  static FusedDrive Map() {
    FusedDriveOptions options;
    options.profile.cell_size_um = 200'000;
    return FusedDrive::Fuse(piece_->drive(), SurveyDrive(piece_->drive(), {}).value(), options)
        .value();
  }

  static std::vector<Eigen::Vector3d> Way() {
    std::vector<Eigen::Vector3d> way;
    for (const DriveScan& scan : piece_->drive().scans)
      way.push_back(scan.T_world_sensor.translation());
    return way;
  }

  static DamagedMap Damaged(const DamageOptions& options) {
    FusedDrive map = Map();
    return DamagedMap::Make(map, Way(), options).value();
  }

  static std::vector<Contradiction> Track(MapSource& map) {
    std::vector<Contradiction> found;
    MapView view(map);
    DriveMonitor monitor(view, {}, [&found](const Contradiction& c) { found.push_back(c); });
    DriveLocalizationOptions options;
    options.monitor = &monitor;
    const auto report =
        LocalizeDrive(piece_->drive(), options, view, [](const LocalizedScan& scan) {
          EXPECT_NE(scan.located.health, LocalizationHealth::kLost);
          EXPECT_LT(scan.error.translation_m, 0.15);
        });
    EXPECT_TRUE(report.has_value());
    monitor.Finish();
    EXPECT_EQ(monitor.scans(), kScans);
    return found;
  }

  static ChangesSeen See(const DamagedMap& map) {
    ChangesSeen seen(map.changes(), map.profile(), 2.0, 30.0);
    for (const DriveScan& scan : piece_->drive().scans) {
      std::vector<Eigen::Vector3d> returns;
      const PointCloud cloud = ReadScan(scan.scan).value();
      for (const Eigen::Vector3f& p : cloud.points) {
        returns.push_back(scan.T_world_sensor * p.cast<double>());
      }
      seen.Add(scan.T_world_sensor.translation(), returns);
    }
    return seen;
  }

  inline static std::unique_ptr<StreetPiece> piece_;
};

// In so few scans what moved was mapped where it was last.
TEST_F(MonitoringBenchTest, InTheMapAsItIsNextToNothingLastsButWhereTrafficWas) {
  FusedDrive map = Map();
  const double cell_m = map.profile().cell_size_m();
  std::size_t others = 0;
  for (const Contradiction& c : Track(map)) {
    const Eigen::Vector3d p((static_cast<double>(c.cell_x) + 0.5) * cell_m,
                            (static_cast<double>(c.cell_y) + 0.5) * cell_m,
                            (c.low_mm + 500) * 1e-3);
    const bool is_traffic = std::any_of(piece_->traffic().begin(), piece_->traffic().end(),
                                        [&](const auto& box) { return box.Contains(p, 0.6); });
    others += c.kind == ContradictionKind::kMoving || is_traffic ? 0U : 1U;
  }
  EXPECT_LT(others, 20U);
}

TEST_F(MonitoringBenchTest, WhatIsReportedWasMadeAndWhatWasMadeIsReported) {
  DamagedMap map = Damaged({.column_share = 0.3, .cars = 2, .is_building_gone = true});
  const std::vector<Contradiction> found = Track(map);
  const ChangeScore score = ScoreChanges(found, map.changes(), See(map), 6, map.profile());
  for (const std::size_t kind : {0U, 1U}) {
    EXPECT_GT(score.reported[kind], 200U);
    EXPECT_GT(static_cast<double>(score.right[kind]),
              0.8 * static_cast<double>(score.reported[kind]));
  }
  std::size_t cells = 0;
  std::size_t reported = 0;
  for (const auto& parts : score.recall) {
    for (const Found& part : parts) {
      cells += part.cells;
      reported += part.found;
    }
  }
  EXPECT_GT(cells, 5'000U);
  EXPECT_GT(static_cast<double>(reported), 0.8 * static_cast<double>(cells));
}

TEST_F(MonitoringBenchTest, DamageIsWhatItSaysItIs) {
  EXPECT_TRUE(Damaged({}).changes().cells.empty());
  const DamagedMap gone = Damaged({.is_building_gone = true});
  EXPECT_GT(gone.changes().cells.size(), 100U);
  for (const ChangedCell& cell : gone.changes().cells) {
    EXPECT_EQ(cell.part, ChangePart::kBuilding);
    EXPECT_EQ(cell.vanished, 0U);
    EXPECT_NE(cell.appeared, 0U);
    EXPECT_EQ(gone.changes().At(cell.x, cell.y)->appeared, cell.appeared);
  }
  const DamagedMap again = Damaged({.is_building_gone = true});
  EXPECT_EQ(again.changes().cells.size(), gone.changes().cells.size());
}

TEST(ChangesSeenTest, RaysSeeWhereTheyPassAndWhereTheyEnd) {
  MapProfile profile;
  ChangedSegments changes;
  changes.Add({50, 0, 0, 1, ChangePart::kCars});   // put at (5.05, 0.05)
  changes.Add({100, 0, 1, 0, ChangePart::kCars});  // taken from (10.05, 0.05)
  ChangesSeen seen(changes, profile, 2.0, 30.0);
  const std::vector<Eigen::Vector3d> returns{{10.05, 0.05, 0.5}};
  seen.Add({0.0, 0.05, 0.5}, returns);
  EXPECT_EQ(seen.scans(0, ContradictionKind::kVanished), 1U);
  EXPECT_EQ(seen.scans(1, ContradictionKind::kAppeared), 1U);
  // Above both, and too short.
  seen.Add({0.0, 0.05, 1.5}, std::vector<Eigen::Vector3d>{{10.05, 0.05, 1.5}});
  seen.Add({0.0, 0.05, 0.5}, std::vector<Eigen::Vector3d>{{4.0, 0.05, 0.5}});
  EXPECT_EQ(seen.scans(0, ContradictionKind::kVanished), 1U);
  EXPECT_EQ(seen.scans(1, ContradictionKind::kAppeared), 1U);
}

TEST(ChangeScoreTest, ACellBesideIsNearEnoughAndAnotherKindIsNot) {
  MapProfile profile;
  ChangedSegments changes;
  changes.Add({50, 0, 0, 1, ChangePart::kCars});
  ChangesSeen seen(changes, profile, 2.0, 30.0);
  seen.Add({0.0, 0.05, 0.5}, std::vector<Eigen::Vector3d>{{10.05, 0.05, 0.5}});
  Contradiction beside;
  beside.kind = ContradictionKind::kVanished;
  beside.cell_x = 51;
  beside.high_mm = 1'000;
  Contradiction other = beside;
  other.kind = ContradictionKind::kAppeared;
  Contradiction above = beside;
  above.low_mm = 1'000;
  above.high_mm = 2'000;
  Contradiction away = beside;
  away.cell_x = 53;
  const std::vector<Contradiction> reported{beside, other, above, away};
  const ChangeScore score = ScoreChanges(reported, changes, seen, 1, profile);
  EXPECT_EQ(score.reported[1], 3U);
  EXPECT_EQ(score.right[1], 1U);
  EXPECT_EQ(score.right[0], 0U);
  EXPECT_EQ(score.recall[1][1].cells, 1U);
  EXPECT_EQ(score.recall[1][1].found, 1U);
  EXPECT_EQ(score.exact.found, 0U);
  EXPECT_EQ(ScoreChanges(reported, changes, seen, 2, profile).recall[1][1].cells, 0U);
}

}  // namespace
}  // namespace atlas::testing
