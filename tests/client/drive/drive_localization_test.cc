// A drive of three scans before a jump and two after it, localized by a method that is told what to
// answer.
#include "client/drive/drive_localization.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

// Answers the start, moved by what the script says next.
class ScriptedLocalizer : public ScanLocalizer {
 public:
  struct Answer {
    Eigen::Vector3d moved_m = Eigen::Vector3d::Zero();
    LocalizationHealth health = LocalizationHealth::kGood;
  };
  explicit ScriptedLocalizer(std::vector<Answer> script) : script_(std::move(script)) {}

  void Start(const Pose& T_world_sensor, const StartKnowledge& known) override {
    starts.push_back(T_world_sensor);
    known_starts.push_back(known);
  }
  Result<LocatedScan> Locate(const PointCloud&, const Eigen::Quaterniond&, double) override {
    if (next_ == script_.size()) return Error(StatusCode::kUnavailable, "gone");
    const Answer& answer = script_[next_++];
    LocatedScan located;
    located.T_world_sensor = starts.back();
    located.T_world_sensor.translation() += answer.moved_m;
    located.health = answer.health;
    located.covariance = 0.01 * Eigen::Matrix4d::Identity();
    return located;
  }

  std::vector<Pose> starts;
  std::vector<StartKnowledge> known_starts;

 private:
  std::vector<Answer> script_;
  std::size_t next_ = 0;
};

class DriveLocalizationTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) / (std::string("drive_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    const float point[4] = {5.0F, 0.0F, 0.0F, 0.0F};
    for (std::uint32_t i = 0; i < 5; ++i) {
      DriveScan scan;
      scan.number = i;
      scan.scan = folder_ / ("00000" + std::to_string(i) + ".bin");
      scan.T_world_sensor.translation().x() = i + (i >= 3 ? 100.0 : 0.0);
      std::ofstream(scan.scan, std::ios::binary)
          .write(reinterpret_cast<const char*>(point), sizeof(point));
      drive_.scans.push_back(scan);
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Result<DriveLocalizationReport> Run(ScanLocalizer& localizer) {
    return LocalizeDrive(drive_, options_, localizer,
                         [this](const LocalizedScan& scan) { scans_.push_back(scan); });
  }

  std::filesystem::path folder_;
  DriveFolder drive_;
  DriveLocalizationOptions options_;
  std::vector<LocalizedScan> scans_;
};

TEST_F(DriveLocalizationTest, JumpsBeginAnew) {
  ScriptedLocalizer localizer({{{0, 0, 0}}, {{1, 0, 0}}, {{2, 0, 0}}, {{0, 0, 0}}, {{1, 0, 0}}});
  const auto report = Run(localizer);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->restarts, 1U);
  EXPECT_EQ(report->scans, 5U);
  EXPECT_EQ(report->score.failures(), 0U);
  ASSERT_EQ(localizer.starts.size(), 2U);
  EXPECT_DOUBLE_EQ(localizer.starts[1].translation().x(), 103.0);
  std::vector<bool> restarted;
  for (const LocalizedScan& scan : scans_) restarted.push_back(scan.is_after_jump);
  EXPECT_EQ(restarted, (std::vector<bool>{false, false, false, true, false}));
}

TEST_F(DriveLocalizationTest, AStartIsToldAsFarOffAsItMayBeAndBelieved) {
  options_.start = ToldStart{2.0, 0.6};
  double furthest_m = 0.0;
  double highest_m = 0.0;
  for (options_.seed = 0; options_.seed < 30; ++options_.seed) {
    ScriptedLocalizer localizer(std::vector<ScriptedLocalizer::Answer>(5));
    ASSERT_TRUE(Run(localizer).has_value());
    ASSERT_EQ(localizer.starts.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      const Eigen::Vector3d off_m =
          localizer.starts[i].translation() - Eigen::Vector3d(i == 0 ? 0.0 : 103.0, 0.0, 0.0);
      furthest_m = std::max(furthest_m, off_m.head<2>().norm());
      highest_m = std::max(highest_m, std::abs(off_m.z()));
      const auto* covariance = std::get_if<PoseCovariance>(&localizer.known_starts[i]);
      ASSERT_NE(covariance, nullptr);
      EXPECT_NEAR(std::sqrt((*covariance)(2, 2)), 0.2, 1e-9) << "three of them";
    }
  }
  EXPECT_LE(furthest_m, 2.0);
  EXPECT_GT(furthest_m, 1.0);
  EXPECT_LE(highest_m, 0.6);
  EXPECT_GT(highest_m, 0.4);
}

TEST_F(DriveLocalizationTest, WithoutAnErrorTheStartIsAHint) {
  ScriptedLocalizer localizer(std::vector<ScriptedLocalizer::Answer>(5));
  ASSERT_TRUE(Run(localizer).has_value());
  ASSERT_EQ(localizer.known_starts.size(), 2U);
  for (const StartKnowledge& known : localizer.known_starts) {
    EXPECT_TRUE(std::holds_alternative<StartHint>(known));
  }
}

TEST_F(DriveLocalizationTest, OfAShotItIsToldHowFarOffItMayBe) {
  options_.shots = DriveLocalizationOptions::Shots{0.4, 0.02, 3};
  ScriptedLocalizer localizer(std::vector<ScriptedLocalizer::Answer>(15));
  ASSERT_TRUE(Run(localizer).has_value());
  ASSERT_EQ(localizer.known_starts.size(), 15U);
  for (const StartKnowledge& known : localizer.known_starts) {
    const auto* hint = std::get_if<StartHint>(&known);
    ASSERT_NE(hint, nullptr);
    EXPECT_DOUBLE_EQ(hint->within_m, 0.4);
    EXPECT_DOUBLE_EQ(hint->within_rad, 0.02);
  }
}

TEST_F(DriveLocalizationTest, AToldStartIsOfTrackingAlone) {
  ScriptedLocalizer localizer({});
  options_.start.emplace().height_m = 0.0;
  EXPECT_EQ(Run(localizer).error().code(), StatusCode::kInvalidArgument);
  options_.start.emplace();
  options_.shots.emplace();
  EXPECT_EQ(Run(localizer).error().code(), StatusCode::kInvalidArgument);
  options_.shots.reset();
  options_.mode = LocalizationMode::kPaper;
  EXPECT_EQ(Run(localizer).error().code(), StatusCode::kInvalidArgument);
}

TEST_F(DriveLocalizationTest, ErrorsAreSplitAndMeasuredInSigmas) {
  options_.selection.end = 1;
  ScriptedLocalizer localizer({{{0.2, 0.1, -0.3}}});
  ASSERT_TRUE(Run(localizer).has_value());
  ASSERT_EQ(scans_.size(), 1U);
  EXPECT_NEAR(scans_[0].offset.along_m, 0.2, 1e-12);
  EXPECT_NEAR(scans_[0].offset.left_m, 0.1, 1e-12);
  EXPECT_NEAR(scans_[0].offset.up_m, -0.3, 1e-12);
  EXPECT_NEAR(scans_[0].normalized_square.value(), 4.0 + 1.0 + 9.0, 1e-6);
  EXPECT_FALSE(scans_[0].is_failure);
}

TEST_F(DriveLocalizationTest, LostAndFarOffAreFailures) {
  options_.selection.end = 2;
  ScriptedLocalizer localizer({{{0, 0, 0}, LocalizationHealth::kLost}, {{2.5, 0, 0}}});
  const auto report = Run(localizer);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->score.failures(), 2U);
  EXPECT_EQ(report->score.lost(), 1U);
  EXPECT_TRUE(scans_[0].is_failure && scans_[1].is_failure);
}

TEST_F(DriveLocalizationTest, HealthIsCountedAndSoIsWhatWasCalledGoodAndIsNot) {
  ScriptedLocalizer localizer({{{0, 0, 0}},
                               {{2.5, 0, 0}},
                               {{2.0, 0, 0}, LocalizationHealth::kWeak},
                               {{9, 0, 0}, LocalizationHealth::kLost},
                               {{1, 0, 0}}});
  const auto report = Run(localizer);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->good, 3U);
  EXPECT_EQ(report->weak, 1U);
  EXPECT_EQ(report->score.lost(), 1U);
  EXPECT_EQ(report->good_failures, 1U);
}

TEST_F(DriveLocalizationTest, NoRestartIsNone) {
  options_.is_restarted = false;
  ScriptedLocalizer localizer({{}, {{1, 0, 0}}, {{2, 0, 0}}, {{103, 0, 0}}, {{104, 0, 0}}});
  const auto report = Run(localizer);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->restarts, 0U);
  for (const LocalizedScan& scan : scans_) EXPECT_FALSE(scan.is_after_jump);
}

TEST_F(DriveLocalizationTest, ADamagedScanIsLostAndTrackingGoesOn) {
  std::filesystem::resize_file(drive_.scans[1].scan, 10);
  ScriptedLocalizer localizer({{}, {{2, 0, 0}}, {{0, 0, 0}}, {{1, 0, 0}}});
  const auto report = Run(localizer);
  ASSERT_TRUE(report.has_value()) << report.error().message();
  ASSERT_EQ(report->unreadable.size(), 1U);
  EXPECT_EQ(report->unreadable[0].scan, 1U);
  EXPECT_NE(report->unreadable[0].why.message().find("truncated"), std::string::npos);
  EXPECT_EQ(report->scans, 5U);
  EXPECT_EQ(report->score.lost(), 1U);
  EXPECT_EQ(report->score.failures(), 1U);
  ASSERT_EQ(scans_.size(), 5U);
  EXPECT_EQ(scans_[1].scan, 1U);
  EXPECT_EQ(scans_[1].located.health, LocalizationHealth::kLost);
  EXPECT_TRUE(scans_[1].located.T_world_sensor.isApprox(scans_[0].located.T_world_sensor));
  EXPECT_EQ(report->restarts, 1U);
}

TEST_F(DriveLocalizationTest, WhereNothingCameBackTheRestIsLocalized) {
  const float none = std::nanf("");
  const float point[4] = {none, none, none, 0.0F};
  std::ofstream(drive_.scans[1].scan, std::ios::binary | std::ios::app)
      .write(reinterpret_cast<const char*>(point), sizeof(point));
  ScriptedLocalizer localizer({{}, {{1, 0, 0}}, {{2, 0, 0}}, {}, {{1, 0, 0}}});
  const auto report = Run(localizer);
  ASSERT_TRUE(report.has_value()) << report.error().message();
  EXPECT_TRUE(report->unreadable.empty());
  EXPECT_EQ(report->dropped_returns, 1U);
  EXPECT_EQ(report->score.lost(), 0U);
}

TEST_F(DriveLocalizationTest, ADamagedScanEndsSingleShots) {
  options_.shots = {0.4, 0.02, 1};
  std::filesystem::resize_file(drive_.scans[1].scan, 10);
  ScriptedLocalizer localizer({{}, {}});
  EXPECT_EQ(Run(localizer).error().code(), StatusCode::kInvalidData);
}

TEST_F(DriveLocalizationTest, ShotsStartAnewEachTime) {
  options_.selection.end = 1;
  options_.shots = {0.4, 0.02, 3};
  ScriptedLocalizer localizer({{}, {}, {}});
  ASSERT_TRUE(Run(localizer).has_value());
  ASSERT_EQ(localizer.starts.size(), 3U);
  EXPECT_FALSE(localizer.starts[0].isApprox(localizer.starts[1]));
  EXPECT_EQ(scans_[2].trial, 2U);
}

TEST_F(DriveLocalizationTest, AnErrorNamesTheScan) {
  ScriptedLocalizer localizer({{}, {}});
  const auto report = Run(localizer);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code(), StatusCode::kUnavailable);
  EXPECT_EQ(report.error().message(), "scan 2: gone");
}

TEST_F(DriveLocalizationTest, ThePapersReachIsItsOwn) {
  EXPECT_DOUBLE_EQ(options_.range_m(), 100.0);
  options_.mode = LocalizationMode::kPaper;
  EXPECT_DOUBLE_EQ(options_.range_m(), 40.0);
  options_.max_range_m = 0.5;
  EXPECT_EQ(options_.Validate().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
