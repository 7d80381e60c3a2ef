#include "core/localization/registration/pose_search.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/localization/window/local_map.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::kDegree;
using testing::PoseError;
using testing::StreetMap;
using testing::UprightPose;

const Eigen::Vector3d kCenter(0.0, 0.0, 1.8);

ScanFeatures FeaturesAt(const Pose& T_world_level) {
  return ExtractFeatures(CastLeveledScan(testing::QuickSensor(), testing::Street(), T_world_level),
                         testing::QuickOptions().features);
}

TEST(PoseSearchTest, AmongItsStartsIsOneThatARegistrationReaches) {
  const MapWindow window = StreetMap().Window(kCenter, 30.0);
  const CoarseOccupancy coarse(window, LocalMapOptions().coarse_block_m);
  const Pose expected = UprightPose(kCenter, 0.0);
  for (const double ahead_m : {-1.8, 0.0, 1.9}) {
    for (const double turn_deg : {-60.0, -20.0, 35.0, 65.0}) {
      const Pose truth = UprightPose({ahead_m, 0.5, 1.8 + 0.01 * ahead_m}, turn_deg * kDegree);
      double nearest_m = 1e9;
      for (const Pose& start :
           SearchPoses(coarse, window.origin(), FeaturesAt(truth), expected, {}, {})) {
        const PoseError error = ErrorOf(start, truth);
        nearest_m =
            error.angle_rad < 4.0 * kDegree ? std::min(nearest_m, error.horizontal_m) : nearest_m;
      }
      EXPECT_LT(nearest_m, 1.0) << ahead_m << " m, " << turn_deg << " deg";
    }
  }
}

TEST(PoseSearchTest, StartsAreInReachAndApart) {
  const MapWindow window = StreetMap().Window(kCenter, 30.0);
  const PoseSearchOptions options;
  const CoarseOccupancy coarse(window, LocalMapOptions().coarse_block_m);
  const Pose expected = UprightPose(kCenter, 0.4);
  const SearchReach reach{1.5, 1.5, 0.5};
  const std::vector<Pose> starts =
      SearchPoses(coarse, window.origin(), FeaturesAt(expected), expected, reach, options);
  ASSERT_FALSE(starts.empty());
  EXPECT_LE(starts.size(), options.candidates);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const Eigen::Vector3d offset = starts[i].translation() - expected.translation();
    EXPECT_LE(offset.head<2>().cwiseAbs().maxCoeff(), 1.5 + 1e-6);
    EXPECT_EQ(offset.z(), 0.0);
    EXPECT_LE(ErrorOf(starts[i], expected).angle_rad, 0.5 + 1e-6);
    for (std::size_t k = 0; k < i; ++k) {
      const PoseError apart = ErrorOf(starts[i], starts[k]);
      EXPECT_TRUE(apart.horizontal_m >= options.apart_m - 1e-6 ||
                  apart.angle_rad >= options.apart_rad - 1e-6);
    }
  }
}

TEST(PoseSearchTest, AFewColumnsSayNothing) {
  const MapWindow window = StreetMap().Window(kCenter, 30.0);
  const CoarseOccupancy coarse(window, 0.8F);
  ScanFeatures few = FeaturesAt(UprightPose(kCenter, 0.0));
  few.columns.resize(14);
  for (const ScanFeatures& features : {ScanFeatures(), few}) {
    EXPECT_TRUE(
        SearchPoses(coarse, window.origin(), features, UprightPose(kCenter, 0.0), {}, {}).empty());
  }
}

TEST(PoseSearchTest, CoarselyOccupiedIsABlockAroundAnyStructure) {
  testing::PaintedMap map;
  map.Put(0, 0, testing::ColumnLayer(0.0, 0b0010));
  const MapWindow window = map.Window(Eigen::Vector3d::Zero(), 10.0);
  const CoarseOccupancy coarse(window, 0.8F);
  const auto at = [&](double x, double y, double z) {
    return coarse.IsOccupied((Eigen::Vector3d(x, y, z) - window.origin()).cast<float>());
  };
  EXPECT_TRUE(at(0.05, 0.05, 1.5));
  EXPECT_TRUE(at(0.75, -0.65, 1.5));  // less than a block away
  EXPECT_FALSE(at(1.75, 0.05, 1.5));  // more than two blocks away
  EXPECT_FALSE(at(0.05, 0.05, 0.5));
  for (const double far : {-1e3, 1e3}) {
    EXPECT_FALSE(at(far, 0.0, 1.5));
    EXPECT_FALSE(at(0.0, far, 1.5));
    EXPECT_FALSE(at(0.0, 0.0, far));
  }
}

}  // namespace
}  // namespace atlas
