#include "core/scan/leveled_scan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/scan/ego_box.h"
#include "core/scan/ray_table.h"

namespace atlas {
namespace {

// All returns in row 0, spread over the sectors by their azimuth in the sensor frame.
RangeImage ImageOf(std::vector<Eigen::Vector3f> points) {
  const auto sector = [](const Eigen::Vector3f& p) {
    const double turn = std::atan2(p.y(), p.x()) / (2.0 * std::numbers::pi);
    return static_cast<std::size_t>(71.999 * (turn < 0.0 ? turn + 1.0 : turn));
  };
  std::stable_sort(points.begin(), points.end(),
                   [&](const auto& a, const auto& b) { return sector(a) < sector(b); });
  RangeImage image;
  image.rows = 1;
  image.sector_begin.assign(RangeImage::kSectors + 1, 0);
  for (const Eigen::Vector3f& p : points) {
    image.x.push_back(p.x());
    image.y.push_back(p.y());
    image.z.push_back(p.z());
    image.source.push_back(static_cast<std::uint32_t>(image.source.size()));
    for (std::size_t s = sector(p) + 1; s < image.sector_begin.size(); ++s) {
      ++image.sector_begin[s];
    }
  }
  for (std::vector<float>* plane : {&image.x, &image.y, &image.z}) {
    plane->resize(points.size() + RangeImage::kPadding, 1e6F);
  }
  return image;
}

TEST(LeveledScanTest, TurnsEveryReturnUpright) {
  std::mt19937 random(31);
  std::uniform_real_distribution<float> unit(-1.0F, 1.0F);
  for (int round = 0; round < 20; ++round) {
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < 50; ++i) {
      points.emplace_back(40.0F * unit(random), 40.0F * unit(random), 3.0F * unit(random));
    }
    const RangeImage image = ImageOf(points);
    const Eigen::Quaternionf R_level_sensor(Eigen::AngleAxisf(
        0.3F * unit(random), Eigen::Vector3f(unit(random), unit(random), 0.0F).normalized()));
    const LeveledScan scan =
        LevelScan(image, std::vector<std::uint8_t>(image.size(), 1), R_level_sensor);
    ASSERT_EQ(scan.size(), image.size());
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const Eigen::Vector3f p =
          R_level_sensor * Eigen::Vector3f(image.x[i], image.y[i], image.z[i]);
      EXPECT_LT((p - Eigen::Vector3f(scan.x[i], scan.y[i], scan.z[i])).norm(), 1e-4F);
      EXPECT_NEAR(scan.range_m[i], p.head<2>().norm(), 1e-4F);
      const double azimuth = std::atan2(p.y(), p.x());
      EXPECT_NEAR(std::remainder(scan.azimuth_rad[i] - azimuth, 2.0 * std::numbers::pi), 0.0, 3e-5);
      EXPECT_GE(scan.azimuth_rad[i], 0.0F);
    }
  }
}

TEST(LeveledScanTest, AzimuthsRoundedUpToAFullTurnStillHaveARay) {
  const RayTable rays(GridGeometry{100'000, 100});
  const RangeImage image = ImageOf({{10.0F, -1e-9F, 0.0F}, {10.0F, -1e-6F, 0.0F}});
  const LeveledScan scan = LevelScan(image, {0, 0}, Eigen::Quaternionf::Identity());
  for (const float azimuth : scan.azimuth_rad) {
    EXPECT_EQ(rays.Ray(azimuth), rays.rays() - 1);
  }
}

TEST(LeveledScanTest, KeepsWhatSegmentationSaid) {
  const RangeImage image = ImageOf({{10, 1, 0}, {10, 2, 0}, {-5, 3, 1}});
  const LeveledScan scan = LevelScan(image, {1, 0, 1}, Eigen::Quaternionf::Identity());
  EXPECT_EQ(scan.is_ground, (std::vector<std::uint8_t>{1, 0, 1}));
}

TEST(LeveledScanTest, ColumnSpacingIsThatOfTheDensestSector) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 25; ++i) {  // 0.2 degrees apart, within one sector of 5 degrees
    const float azimuth = (static_cast<float>(i) + 0.5F) * 0.2F * std::numbers::pi_v<float> / 180;
    points.emplace_back(10.0F * std::cos(azimuth), 10.0F * std::sin(azimuth), 0.0F);
  }
  points.emplace_back(-10.0F, 1.0F, 0.0F);
  const LeveledScan scan = LevelScan(ImageOf(points), std::vector<std::uint8_t>(points.size(), 0),
                                     Eigen::Quaternionf::Identity());
  EXPECT_NEAR(scan.column_spacing_rad, 0.2 * std::numbers::pi / 180.0, 1e-6);
}

TEST(LeveledScanTest, AnEmptyImageIsAnEmptyScan) {
  const LeveledScan scan = LevelScan(ImageOf({}), {}, Eigen::Quaternionf::Identity());
  EXPECT_EQ(scan.size(), 0U);
  EXPECT_TRUE(std::isfinite(scan.column_spacing_rad));
}

TEST(EgoBoxTest, IsOpenAtItsFacesAndHasAnyHeight) {
  const EgoBox box{3.0F, 2.0F, 1.0F};
  for (const float z : {-100.0F, 0.0F, 100.0F}) {
    EXPECT_TRUE(box.Contains({0.0F, 0.0F, z}));
    EXPECT_TRUE(box.Contains({2.99F, 0.99F, z}));
    EXPECT_TRUE(box.Contains({-1.99F, -0.99F, z}));
    EXPECT_FALSE(box.Contains({3.0F, 0.0F, z}));
    EXPECT_FALSE(box.Contains({-2.0F, 0.0F, z}));
    EXPECT_FALSE(box.Contains({0.0F, 1.0F, z}));
    EXPECT_FALSE(box.Contains({0.0F, -1.0F, z}));
  }
}

}  // namespace
}  // namespace atlas
