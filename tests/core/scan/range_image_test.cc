#include "core/scan/range_image.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "tests/core/support/synthetic_scan.h"

namespace atlas {
namespace {

using testing::GroundRange;
using testing::Nearest;
using testing::Rings;
using testing::RoundWallRange;
using testing::SyntheticSensor;

std::optional<double> Yard(const Eigen::Vector3d& direction) {
  return Nearest(GroundRange(direction, 1.8), RoundWallRange(direction, 25.0));
}

SensorLayout LayoutOf(const SyntheticSensor& sensor) {
  SensorLayout layout;
  for (const double elevation_deg : sensor.elevation_deg) {
    layout.elevation_rad.push_back(static_cast<float>(elevation_deg * testing::kDegree));
  }
  return layout;
}

TEST(RangeImageTest, EveryReturnStandsOnceWhereItPoints) {
  for (const bool is_top_first : {false, true}) {
    const SyntheticSensor sensor{Rings(32, -24.8, 0.84), 1800, is_top_first};
    const PointCloud cloud = testing::Scan(sensor, Yard);
    const RangeImage image = MakeRangeImage(cloud, LayoutOf(sensor), 1);
    ASSERT_EQ(image.rows, 32);
    ASSERT_EQ(image.sector_begin.back(), image.size());
    std::set<std::uint32_t> seen;
    for (int row = 0; row < image.rows; ++row) {
      for (int sector = 0; sector < RangeImage::kSectors; ++sector) {
        for (std::uint32_t i = image.Begin(row, sector); i < image.End(row, sector); ++i) {
          const Eigen::Vector3f p(image.x[i], image.y[i], image.z[i]);
          EXPECT_EQ(p, cloud.points[image.source[i]]);
          EXPECT_TRUE(seen.insert(image.source[i]).second);
          const double turn = std::atan2(p.y(), p.x()) / (2.0 * M_PI);
          EXPECT_NEAR(72.0 * (turn < 0.0 ? turn + 1.0 : turn), sector + 0.5, 0.5001);
          const double elevation = std::atan2(p.z(), std::hypot(p.x(), p.y()));
          EXPECT_NEAR(elevation, (-24.8 + 0.84 * row) * testing::kDegree, 1e-3);
        }
      }
    }
    const EgoBox ego;
    const auto outside = std::count_if(cloud.points.begin(), cloud.points.end(),
                                       [&](const Eigen::Vector3f& p) { return !ego.Contains(p); });
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(outside));
  }
}

TEST(RangeImageTest, FewerRingsAreSomeOfAllRings) {
  const SyntheticSensor sensor{Rings(64, -24.8, 0.42), 900, true};
  const PointCloud cloud = testing::Scan(sensor, Yard);
  const RangeImage all = MakeRangeImage(cloud, LayoutOf(sensor), 1);
  for (const int step : {2, 3, 4, 64}) {
    const RangeImage some = MakeRangeImage(cloud, LayoutOf(sensor), step);
    ASSERT_EQ(some.rows, (64 + step - 1) / step);
    for (int row = 0; row < some.rows; ++row) {
      for (int sector = 0; sector < RangeImage::kSectors; ++sector) {
        const auto from = all.source.begin();
        EXPECT_TRUE(std::equal(some.source.begin() + some.Begin(row, sector),
                               some.source.begin() + some.End(row, sector),
                               from + all.Begin(row * step, sector),
                               from + all.End(row * step, sector)));
      }
    }
  }
}

TEST(RangeImageTest, IsPaddedFarAway) {
  const SyntheticSensor sensor{Rings(16, -15, 2), 360};
  const RangeImage image = MakeRangeImage(testing::Scan(sensor, Yard), LayoutOf(sensor), 1);
  ASSERT_EQ(image.x.size(), image.size() + RangeImage::kPadding);
  for (std::size_t i = image.size(); i < image.x.size(); ++i) {
    EXPECT_GE(std::min({image.x[i], image.y[i], image.z[i]}), 1e5F);
  }
}

TEST(RangeImageTest, AnEmptyScanHasEmptyRows) {
  const SensorLayout layout = LayoutOf(testing::Vlp16());
  PointCloud ego_only;
  ego_only.points.assign(20, Eigen::Vector3f(0.3F, 0.3F, 0.0F));
  for (const PointCloud& cloud : {PointCloud(), ego_only}) {
    const RangeImage image = MakeRangeImage(cloud, layout, 1);
    EXPECT_EQ(image.rows, 16);
    EXPECT_EQ(image.size(), 0U);
    EXPECT_EQ(image.End(15, RangeImage::kSectors - 1), 0U);
  }
}

TEST(AssignRowsTest, RingsThatAreMissingLeaveTheirRowsEmpty) {
  // Rows 0..15; a scan in which rings 3, 7 and all above 9 have no return.
  std::vector<double> seen;
  for (const int ring : {0, 1, 2, 4, 5, 6, 8, 9}) {
    seen.push_back(-15.0 + 2.0 * ring);
  }
  for (const bool is_top_first : {false, true}) {
    const PointCloud cloud = testing::Scan({seen, 900, is_top_first}, Yard);
    const RingSplit split = SplitRings(cloud, EgoBox());
    std::vector<int> expected{0, 1, 2, 4, 5, 6, 8, 9};
    if (is_top_first) {
      std::reverse(expected.begin(), expected.end());
    }
    EXPECT_EQ(AssignRows(split, LayoutOf(testing::Vlp16()).elevation_rad), expected);
  }
}

TEST(AssignRowsTest, HalvesOfARingShareItsRow) {
  RingSplit split;
  split.runs = {{0, 100, -0.10F}, {100, 150, -0.05F}, {150, 200, -0.05F}, {200, 300, 0.0F}};
  const std::vector<float> rows{-0.10F, -0.05F, 0.0F, 0.05F};
  EXPECT_EQ(AssignRows(split, rows), (std::vector<int>{0, 1, 1, 2}));
  split.is_bottom_first = false;
  std::reverse(split.runs.begin(), split.runs.end());
  EXPECT_EQ(AssignRows(split, rows), (std::vector<int>{2, 1, 1, 0}));
}

TEST(AssignRowsTest, NoRunsHaveNoRows) {
  EXPECT_TRUE(AssignRows(RingSplit(), std::vector<float>{0.0F, 0.1F}).empty());
}

}  // namespace
}  // namespace atlas
