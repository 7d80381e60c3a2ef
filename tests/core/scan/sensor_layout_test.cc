#include "core/scan/sensor_layout.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/scan/range_image.h"
#include "tests/core/support/synthetic_scan.h"

namespace atlas {
namespace {

using testing::GroundRange;
using testing::Nearest;
using testing::Rings;
using testing::RoundWallRange;
using testing::SyntheticSensor;

std::optional<double> WalledYard(const Eigen::Vector3d& direction) {
  return Nearest(GroundRange(direction, 1.8), RoundWallRange(direction, 30.0));
}

std::optional<double> OpenPlain(const Eigen::Vector3d& direction) {
  return GroundRange(direction, 1.8);
}

int Channels(const SyntheticSensor& sensor, const testing::World& world) {
  SensorLayoutEstimator estimator;
  estimator.Add(testing::Scan(sensor, world));
  const Result<SensorLayout> layout = estimator.Estimate();
  return layout ? layout->channels() : 0;
}

TEST(RingSplitterTest, FindsEveryRingInEitherOrder) {
  for (const bool is_top_first : {false, true}) {
    for (const auto& elevations :
         {Rings(16, -15, 2), Rings(32, -30.67, 1.333), Rings(64, -24.8, 0.42)}) {
      const SyntheticSensor sensor{elevations, 1800, is_top_first};
      const RingSplit split = SplitRings(testing::Scan(sensor, WalledYard), EgoBox());
      ASSERT_EQ(split.runs.size(), elevations.size());
      EXPECT_EQ(split.is_bottom_first, !is_top_first);
      for (std::size_t k = 0; k < elevations.size(); ++k) {
        const std::size_t ring = is_top_first ? elevations.size() - 1 - k : k;
        EXPECT_NEAR(split.runs[k].elevation_rad, elevations[ring] * testing::kDegree, 1e-4);
        EXPECT_GT(split.runs[k].size(), 1700U);  // the steepest rings touch the vehicle's own box
      }
    }
  }
}

TEST(RingSplitterTest, TellsSparseRingsApartThatFollowWithoutAStepBack) {
  // The ring at 1 degree returns only between 10 and 20 degrees, the next only between 170 and 180;
  // the one below them, at -1 degree, ends beyond the sensor's reach.
  const auto world = [](const Eigen::Vector3d& direction) -> std::optional<double> {
    const double azimuth_deg = std::atan2(direction.y(), direction.x()) / testing::kDegree;
    const double elevation_deg = std::asin(direction.z()) / testing::kDegree;
    if (elevation_deg < 0.0) {
      return GroundRange(direction, 1.8);
    }
    const bool is_eight = elevation_deg < 2.0 && azimuth_deg > 10.0 && azimuth_deg < 20.0;
    const bool is_nine = elevation_deg > 2.0 && elevation_deg < 4.0 && azimuth_deg > 170.0;
    return is_eight || is_nine ? std::optional<double>(40.0) : std::nullopt;
  };
  const RingSplit split = SplitRings(testing::Scan(testing::Vlp16(), world), EgoBox());
  ASSERT_EQ(split.runs.size(), 9U);
  EXPECT_EQ(split.runs[7].size(), 50U);
  EXPECT_EQ(split.runs[8].size(), 50U);
}

TEST(RingSplitterTest, AnEmptyScanHasNoRings) {
  EXPECT_TRUE(SplitRings(PointCloud(), EgoBox()).runs.empty());
}

TEST(SensorLayoutTest, SnapsByAngularSpacingWhateverTheRingsSee) {
  EXPECT_EQ(Channels({Rings(16, -15, 2)}, WalledYard), 16);
  EXPECT_EQ(Channels({Rings(16, -15, 2)}, OpenPlain), 16);  // upper half sees the sky
  EXPECT_EQ(Channels({Rings(32, -30.67, 1.333)}, OpenPlain), 32);
  EXPECT_EQ(Channels({Rings(32, -24.8, 0.84)}, WalledYard), 32);  // every second of 64
  EXPECT_EQ(Channels({Rings(64, -24.8, 0.42)}, OpenPlain), 64);
  EXPECT_EQ(Channels({Rings(64, -22.5, 0.714)}, OpenPlain), 64);  // OS1-64
  EXPECT_EQ(Channels({Rings(16, -15, 2), 350}, WalledYard), 16);
}

TEST(SensorLayoutTest, UnevenChannelsAreThoseThatAreSeen) {
  const SyntheticSensor vlp32c{{-25.0,  -15.639, -11.31, -8.843, -7.254, -6.148, -5.333, -4.667,
                                -4.0,   -3.667,  -3.333, -3.0,   -2.667, -2.333, -2.0,   -1.667,
                                -1.333, -1.0,    -0.667, -0.333, 0.0,    0.333,  0.667,  1.0,
                                1.333,  1.667,   2.333,  3.333,  4.667,  7.0,    10.333, 15.0}};
  SensorLayoutEstimator estimator;
  estimator.Add(testing::Scan(vlp32c, WalledYard));
  const Result<SensorLayout> layout = estimator.Estimate();
  ASSERT_TRUE(layout.has_value());
  ASSERT_EQ(layout->channels(), 32);
  for (std::size_t row = 0; row < 32; ++row) {
    EXPECT_NEAR(layout->elevation_rad[row], vlp32c.elevation_deg[row] * testing::kDegree, 1e-3);
  }
}

TEST(SensorLayoutTest, ScansOfOneDriveAddUp) {
  // A scan that shows the lower rings, then one that shows all: rows are those of the second.
  SensorLayoutEstimator estimator;
  estimator.Add(testing::Scan(testing::Vlp16(), OpenPlain));
  estimator.Add(testing::Scan(testing::Vlp16(), WalledYard));
  const Result<SensorLayout> layout = estimator.Estimate();
  ASSERT_TRUE(layout.has_value());
  for (int row = 0; row < 16; ++row) {
    EXPECT_NEAR(layout->elevation_rad[static_cast<std::size_t>(row)],
                (-15.0 + 2.0 * row) * testing::kDegree, 1e-3);
  }
}

TEST(SensorLayoutTest, RefusesScansWithoutRings) {
  SensorLayoutEstimator estimator;
  EXPECT_EQ(estimator.Estimate().error().code(), StatusCode::kInvalidData);
}

TEST(SensorLayoutTest, RefusesScansInAnotherOrder) {
  PointCloud by_column;
  for (int column = 0; column < 900; ++column) {
    for (int ring = 0; ring < 16; ++ring) {
      const float azimuth = static_cast<float>(column) * 0.00698F;
      const float slope = std::tan(static_cast<float>(2 * ring - 15) * 0.01745F);
      by_column.points.emplace_back(10.0F * std::cos(azimuth), 10.0F * std::sin(azimuth),
                                    10.0F * slope);
    }
  }
  PointCloud shuffled = by_column;
  std::shuffle(shuffled.points.begin(), shuffled.points.end(), std::mt19937(3));
  for (const PointCloud& cloud : {by_column, shuffled}) {
    SensorLayoutEstimator estimator;
    estimator.Add(cloud);
    const auto layout = estimator.Estimate();
    ASSERT_FALSE(layout.has_value());
    EXPECT_EQ(layout.error().code(), StatusCode::kInvalidData);
  }
}

TEST(RangeImageTest, KeepsEveryFourthRingFromTheLowest) {
  const SyntheticSensor sensor{Rings(64, -24.8, 0.42), 1800, true};
  const PointCloud cloud = testing::Scan(sensor, WalledYard);
  SensorLayoutEstimator estimator;
  estimator.Add(cloud);
  const Result<SensorLayout> layout = estimator.Estimate();
  ASSERT_TRUE(layout.has_value());
  const RangeImage image = MakeRangeImage(cloud, *layout, RingStep(64, 16));
  ASSERT_EQ(image.rows, 16);
  for (int row = 0; row < image.rows; ++row) {
    for (std::uint32_t i = image.Begin(row, 0); i < image.End(row, RangeImage::kSectors - 1); ++i) {
      const double elevation = std::atan2(image.z[i], std::hypot(image.x[i], image.y[i]));
      ASSERT_NEAR(elevation, (-24.8 + 0.42 * 4 * row) * testing::kDegree, 1e-3);
    }
  }
}

TEST(RangeImageTest, RingStepRounds) {
  EXPECT_EQ(RingStep(64, 16), 4);
  EXPECT_EQ(RingStep(64, 32), 2);
  EXPECT_EQ(RingStep(32, 16), 2);
  EXPECT_EQ(RingStep(16, 64), 1);
  EXPECT_EQ(RingStep(64, 24), 3);  // 2.67
}

TEST(EgoBoxTest, TheVehicleItselfIsLeftOut) {
  PointCloud cloud;
  cloud.points = {{1.0F, 0.5F, -0.4F}, {10.0F, 0.0F, -1.8F}, {10.0F, 0.1F, -1.8F}};
  EXPECT_EQ(SplitRings(cloud, EgoBox()).index, (std::vector<std::uint32_t>{1, 2}));
}

}  // namespace
}  // namespace atlas
