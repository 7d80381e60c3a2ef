// The benchmark's map and its yardstick on a piece of a simulated street.
#include <memory>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "client/drive/drive_localization.h"
#include "tests/bench/localization/fused_drive.h"
#include "tests/bench/localization/raw_icp.h"
#include "tests/bench/localization/street_piece.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kFirstScan = 40;
constexpr std::size_t kScans = 8;

class LocalizationBenchTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    piece_ = std::make_unique<StreetPiece>("localization_bench_test", kFirstScan, kScans);
  }
  static void TearDownTestSuite() { piece_.reset(); }

  static DriveSurvey Survey() { return SurveyDrive(piece_->drive(), {}).value(); }
  static SelectionOptions Even() { return {.parity = ScanParity::kEven}; }

  static DriveLocalizationOptions Shots() {
    DriveLocalizationOptions options;
    options.selection.parity = ScanParity::kOdd;
    options.max_range_m = 40.0;
    options.shots = {0.4, 0.026, 2};
    return options;
  }

  static FusedDrive Map() {
    FusedDriveOptions options;
    options.profile.cell_size_um = 200'000;
    options.selection = Even();
    return FusedDrive::Fuse(piece_->drive(), Survey(), options).value();
  }

  inline static std::unique_ptr<StreetPiece> piece_;
};

TEST_F(LocalizationBenchTest, RawReturnsPlaceScansWithinCentimetres) {
  const auto icp = RawIcp::Make(piece_->drive(), Survey(), Even(), {});
  ASSERT_TRUE(icp.has_value());
  const auto report = LocalizeDrive(piece_->drive(), Shots(), **icp, [](const LocalizedScan& scan) {
    EXPECT_FALSE(scan.normalized_square.has_value());
  });
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->score.shots(), kScans);
  EXPECT_EQ(report->score.failures(), 0U);
  EXPECT_LT(report->score.translation_rmse_m(), 0.03);
  EXPECT_LT(report->score.rotation_rmse_deg(), 0.1);
}

TEST_F(LocalizationBenchTest, RawReturnsOfElsewhereAreNoPlace) {
  const auto icp = RawIcp::Make(piece_->drive(), Survey(), Even(), {});
  ASSERT_TRUE(icp.has_value());
  Pose elsewhere = piece_->drive().scans[1].T_world_sensor;
  elsewhere.translation().x() += 500.0;
  (*icp)->Start(elsewhere, StartHint());
  PointCloud cloud;
  cloud.points = {{5.0F, 0.0F, 0.0F}, {6.0F, 0.0F, 0.0F}};
  EXPECT_EQ((*icp)->Locate(cloud, Eigen::Quaterniond::Identity(), 1.0)->health,
            LocalizationHealth::kLost);
}

TEST_F(LocalizationBenchTest, TheMapInMemoryHoldsTheScansOfBothMethods) {
  FusedDrive map = Map();
  for (const LocalizationMode mode : {LocalizationMode::kAtlas, LocalizationMode::kPaper}) {
    MapView view(map);
    DriveLocalizationOptions options = Shots();
    options.mode = mode;
    const bool is_sure = mode == LocalizationMode::kAtlas;
    const auto report =
        LocalizeDrive(piece_->drive(), options, view, [&](const LocalizedScan& scan) {
          EXPECT_EQ(scan.normalized_square.has_value(), is_sure);
          EXPECT_GT(scan.located.fit, 0.3);
        });
    ASSERT_TRUE(report.has_value());
    EXPECT_EQ(report->score.failures(), 0U);
    EXPECT_LT(report->score.translation_rmse_m(), is_sure ? 0.1 : 0.4);
  }
}

TEST_F(LocalizationBenchTest, AreasAreAnsweredWithTheirTiles) {
  FusedDrive map = Map();
  std::set<std::uint64_t> every;
  std::set<std::uint64_t> near;
  const Eigen::Vector2d place =
      piece_->drive().scans.front().T_world_sensor.translation().head<2>();
  EXPECT_TRUE(map.ReadLevel(0, std::nullopt,
                            [&](const TileBlob& tile) {
                              every.insert(tile.id.Key());
                              return Status();
                            })
                  .ok());
  EXPECT_TRUE(map.ReadLevel(0, DiscArea{place, 1.0},
                            [&](const TileBlob& tile) {
                              near.insert(tile.id.Key());
                              return Status();
                            })
                  .ok());
  EXPECT_GT(map.blob_bytes(), 1'000U);
  EXPECT_FALSE(near.empty());
  EXPECT_LT(near.size(), every.size());
  EXPECT_TRUE(map.ReadLevel(1, std::nullopt,
                            [](const TileBlob&) {
                              return Status(StatusCode::kInternal, "no such level here");
                            })
                  .ok());
}

}  // namespace
}  // namespace atlas::testing
