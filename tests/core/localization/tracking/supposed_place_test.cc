// Places that are supposed: confirmed once scans go along with the vehicle's own steps.
#include <optional>

#include <gtest/gtest.h>

#include "core/localization/odometry/own_motion.h"
#include "core/localization/tracking/place_tracker.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::PaintedMap;
using testing::QuickOptions;
using testing::ShapeWorld;
using testing::UprightPose;

const Eigen::Quaterniond kLevel = Eigen::Quaterniond::Identity();

// Of a place on a street that is supposed, by scans that go along it, and steps of so much as
// somebody tells of them; none: the scans do not fit to each other.
bool IsConfirmedBySteps(std::optional<double> told_m) {
  constexpr double kStep_m = 0.6;
  const PaintedMap& map = testing::StreetMap();
  PlaceTracker tracker(map.profile(), map.Source(), PlaceTrackerOptions(), 25.0);
  const auto truth_at = [](int i) {
    return UprightPose({-6.0 + kStep_m * i, 0.3, 1.8}, 0.0);
  };
  tracker.Suppose(truth_at(0), 0.0);
  for (int i = 0; i < 8; ++i) {
    const LeveledScan scan =
        CastLeveledScan(testing::QuickSensor(), testing::Street(), truth_at(i));
    EXPECT_TRUE(tracker.Prepare().ok());
    tracker.Expect(1.0);
    OwnStep step;
    step.is_known = told_m.has_value();
    step.T_last_now.translation().x() = told_m.value_or(0.0);
    step.covariance = Eigen::Vector4d(0.05, 0.05, 0.03, 0.004).cwiseAbs2().asDiagonal();
    const LocalizationResult result =
        tracker.Track(ExtractFeatures(scan, QuickOptions().features), kLevel, step);
    EXPECT_LT(ErrorOf(result.T_world_sensor, truth_at(i)).horizontal_m, 0.1) << i;
  }
  return tracker.is_confirmed();
}

TEST(SupposedPlaceTest, APlaceThatDoesNotMoveAsTheVehicleDoesIsNotConfirmed) {
  EXPECT_TRUE(IsConfirmedBySteps(0.6));
  EXPECT_TRUE(IsConfirmedBySteps(0.55));
  EXPECT_FALSE(IsConfirmedBySteps(0.1));
  EXPECT_FALSE(IsConfirmedBySteps(std::nullopt));
}

// The map has posts, each like the next, and not what stands behind them. Whoever is supposed to be
// beside the wrong one finds one there with every scan, but not at the speed that the scans tell.
TEST(SupposedPlaceTest, APlaceThatSlidesAlongPostsIsNotConfirmed) {
  ShapeWorld posts;
  posts.patches = {testing::Patch{}};
  for (int i = -25; i <= 25; ++i) {
    for (const double y_m : {-4.05, 4.05}) {
      posts.boxes.push_back(
          testing::Box{{1.0 * i + 0.05, y_m, -1.0}, {1.0 * i + 0.25, y_m + 0.2, 4.0}});
    }
  }
  PaintedMap map;
  map.Paint(posts, 30.0);
  ShapeWorld world = posts;
  for (int i = -12; i <= 12; ++i) {
    for (const double y_m : {-6.05, 5.05}) {
      const double x_m = 2.3 * i + 0.55 * ((i * i + (y_m > 0.0 ? 1 : 0)) % 5);
      world.boxes.push_back(testing::Box{{x_m, y_m, -1.0}, {x_m + 0.6, y_m + 1.0, 6.0}});
    }
  }
  PlaceTrackerOptions options;
  options.confirmation.usual_fit = 0.5;
  PlaceTracker tracker(map.profile(), map.Source(), options, 25.0);
  OwnMotion own({}, {}, {});
  tracker.Suppose(UprightPose({-7.0, 0.3, 1.8}, 0.0), 0.0);
  for (int i = 0; i < 8; ++i) {
    const Pose truth = UprightPose({-6.0 + 1.2 * i, 0.3, 1.8}, 0.0);
    const LeveledScan scan = CastLeveledScan(testing::QuickSensor(), world, truth);
    ASSERT_TRUE(tracker.Prepare().ok());
    tracker.Expect(1.0);
    const ScanFeatures features = ExtractFeatures(scan, QuickOptions().features);
    std::optional<OwnStep> step;
    if (own.is_begun()) {
      step = own.Next(features, 1.0);
    } else {
      own.Begin(features);
    }
    const LocalizationResult result = tracker.Track(features, kLevel, step);
    const double off_m = ErrorOf(result.T_world_sensor, truth).horizontal_m;
    EXPECT_FALSE(result.health == LocalizationHealth::kGood && off_m > 0.3) << i << ": " << off_m;
  }
}

}  // namespace
}  // namespace atlas
