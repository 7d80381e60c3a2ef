// Who sees no further than some metres, because he looks no further, or there is fog.
#include <gtest/gtest.h>

#include "core/localization/localizer.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::ErrorOf;
using testing::QuickOptions;
using testing::StreetMap;
using testing::UprightPose;

LocalizationResult At(Localizer& localizer, const Pose& truth) {
  const LeveledScan scan =
      testing::CastLeveledScan(testing::QuickSensor(), testing::Street(), truth);
  return localizer.Localize(scan, Eigen::Quaterniond::Identity()).value();
}

// Along the street on the map's slope.
Pose OnStreet(double x_m, double y_m = 0.0) {
  return UprightPose({x_m, y_m, 1.8 + 0.01 * x_m}, 0.0);
}

TEST(LocalizerReachTest, WhoSeesTooNearIsWeakWhereItIs) {
  for (const float reach_m : {15.0F, 19.9F, 20.0F}) {
    LocalizerOptions options = QuickOptions();
    options.min_good_reach_m = LocalizerOptions().min_good_reach_m;
    options.features.max_range_m = reach_m;
    Localizer localizer(StreetMap().profile(), StreetMap().Source(), options);
    localizer.Start(OnStreet(-6.3, 0.1));
    for (int i = 0; i < 5; ++i) {
      const Pose truth = OnStreet(-6.0 + 0.5 * i);
      const LocalizationResult result = At(localizer, truth);
      EXPECT_EQ(result.health,
                reach_m < 20.0F ? LocalizationHealth::kWeak : LocalizationHealth::kGood)
          << reach_m << ' ' << i;
      EXPECT_LT(ErrorOf(result.T_world_sensor, truth).horizontal_m, 0.1) << reach_m << ' ' << i;
    }
  }
}

// Fog, or a sensor that is told to reach no further.
LeveledScan SeenUpTo(const LeveledScan& scan, float most_m) {
  LeveledScan seen;
  seen.column_spacing_rad = scan.column_spacing_rad;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.range_m[i] > most_m) continue;
    seen.x.push_back(scan.x[i]);
    seen.y.push_back(scan.y[i]);
    seen.z.push_back(scan.z[i]);
    seen.range_m.push_back(scan.range_m[i]);
    seen.azimuth_rad.push_back(scan.azimuth_rad[i]);
    seen.is_ground.push_back(scan.is_ground[i]);
  }
  return seen;
}

TEST(LocalizerReachTest, SoIsWhoseScanReachesNoFurther) {
  LocalizerOptions options = QuickOptions();
  options.min_good_reach_m = LocalizerOptions().min_good_reach_m;
  Localizer localizer(StreetMap().profile(), StreetMap().Source(), options);
  localizer.Start(OnStreet(-6.3, 0.1));
  for (int i = 0; i < 8; ++i) {
    const bool is_foggy = i >= 4;
    const Pose truth = OnStreet(-6.0 + 0.5 * i);
    const LeveledScan scan =
        SeenUpTo(testing::CastLeveledScan(testing::QuickSensor(), testing::Street(), truth),
                 is_foggy ? 12.0F : 100.0F);
    const auto result = localizer.Localize(scan, Eigen::Quaterniond::Identity());
    ASSERT_TRUE(result);
    EXPECT_EQ(result->health, is_foggy ? LocalizationHealth::kWeak : LocalizationHealth::kGood)
        << i;
  }
}

}  // namespace
}  // namespace atlas
