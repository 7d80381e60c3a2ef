// Scans of rooms whose distances are known.
#include "core/simulation/scan_caster.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/mesh_builder.h"

namespace atlas {
namespace {

constexpr std::uint32_t kFloorLabel = TruthLabel(TruthClass::kRoad, 2);
constexpr std::uint32_t kWallLabel = TruthLabel(TruthClass::kBuilding, 2);
constexpr std::uint32_t kCarLabel = TruthLabel(TruthClass::kMovingCar);

// A floor 1.8 m below the sensor and a wall at x = 12 m.
WorldParts Room() {
  MeshBuilder builder;
  builder.Floor({{-200.0, -200.0, -1.8}, {200.0, 200.0, -1.8}}, kFloorLabel);
  builder.Quad({12.0, -300.0, -2.0}, {12.0, 300.0, -2.0}, {12.0, 300.0, 100.0},
               {12.0, -300.0, 100.0}, kWallLabel);
  return {std::make_shared<const CastableMesh>(builder.Take())};
}

SimulatedScan ScanRoom(double sigma_m) {
  LidarSensor sensor = Vlp16Sensor();
  sensor.range_sigma_m = sigma_m;
  return ScanCaster(sensor).Cast(Room(), {}, {{Pose::Identity()}}, {1, 0});
}

TEST(ScanCasterTest, ExactSensorMeasuresWallAndFloorWhereTheyAre) {
  const SimulatedScan scan = ScanRoom(0.0);
  std::size_t walls = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (scan.labels[i] == kWallLabel) {
      ++walls;
      ASSERT_NEAR(scan.points[i].x, 12.0F, 1e-3) << i;
    } else {
      ASSERT_EQ(scan.labels[i], kFloorLabel);
      ASSERT_NEAR(scan.points[i].z, -1.8F, 1e-3) << i;
    }
  }
  EXPECT_GT(walls, 5000U);
  EXPECT_GT(scan.points.size() - walls, 5000U);
}

TEST(ScanCasterTest, GroundReturnsStayWithinFourSigma) {
  const SimulatedScan scan = ScanRoom(0.02);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (scan.labels[i] == kFloorLabel) {
      ASSERT_NEAR(scan.points[i].z, -1.8F, 4.0 * 0.02) << i;
    }
  }
}

TEST(ScanCasterTest, RangeNoiseHasTheGivenSpreadAndNoBias) {
  const SimulatedScan exact = ScanRoom(0.0);
  const SimulatedScan noisy = ScanRoom(0.02);
  ASSERT_EQ(exact.points.size(), noisy.points.size());
  const auto range = [](const SimulatedPoint& p) {
    return std::hypot(p.x, p.y, p.z);
  };
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < exact.points.size(); ++i) {
    const double error_m = range(noisy.points[i]) - range(exact.points[i]);
    sum += error_m;
    squares += error_m * error_m;
  }
  const auto count = static_cast<double>(exact.points.size());
  EXPECT_NEAR(sum / count, 0.0, 0.001);
  EXPECT_NEAR(std::sqrt(squares / count), 0.02, 0.001);
}

TEST(ScanCasterTest, RingsFollowEachOtherFromBelowWithGrowingAzimuth) {
  const SimulatedScan scan = ScanRoom(0.02);
  double last_elevation_rad = -1.0;
  double last_azimuth_rad = -1.0;
  int rings = 1;
  for (const SimulatedPoint& p : scan.points) {
    const double elevation_rad = std::atan2(p.z, std::hypot(p.x, p.y));
    double azimuth_rad = std::atan2(p.y, p.x);
    azimuth_rad += azimuth_rad < 0.0 ? 2.0 * std::numbers::pi : 0.0;
    if (azimuth_rad <= last_azimuth_rad) {
      ++rings;
      ASSERT_GT(elevation_rad, last_elevation_rad + 0.03);
    } else if (last_azimuth_rad >= 0.0) {
      ASSERT_NEAR(elevation_rad, last_elevation_rad, 1e-4);
    }
    last_azimuth_rad = azimuth_rad;
    last_elevation_rad = elevation_rad;
  }
  EXPECT_EQ(rings, 16);
}

TEST(ScanCasterTest, TrafficHidesWhatStandsBehindIt) {
  MeshBuilder builder;
  builder.Box({{5.0, -1.0, -1.8}, {6.0, 1.0, 3.0}}, kCarLabel);
  const CastableMesh traffic(builder.Take());
  const SimulatedScan scan =
      ScanCaster(Vlp16Sensor()).Cast(Room(), traffic, {{Pose::Identity()}}, {1, 0});
  std::size_t moving = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const SimulatedPoint& p = scan.points[i];
    moving += IsMovingLabel(scan.labels[i]) ? 1U : 0U;
    const bool is_in_shadow = p.x > 6.1F && std::abs(p.y / p.x) < 0.19F;
    ASSERT_FALSE(is_in_shadow) << p.x << " " << p.y << " " << p.z;
  }
  EXPECT_GT(moving, 1000U);
}

TEST(ScanCasterTest, PointsAreInTheSensorFrameOfATiltedPose) {
  LidarSensor sensor = Vlp16Sensor();
  sensor.range_sigma_m = 0.0;
  Pose pose = Pose::Identity();
  pose.linear() = (Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()))
                      .toRotationMatrix();
  pose.translation() = Eigen::Vector3d(-20.0, 3.0, 1.0);
  const SimulatedScan scan = ScanCaster(sensor).Cast(Room(), {}, {&pose, 1}, {1, 0});
  ASSERT_FALSE(scan.points.empty());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const SimulatedPoint& p = scan.points[i];
    const Eigen::Vector3d p_world = pose * Eigen::Vector3d(p.x, p.y, p.z);
    const double error_m = scan.labels[i] == kWallLabel ? p_world.x() - 12.0 : p_world.z() + 1.8;
    ASSERT_NEAR(error_m, 0.0, 1e-3) << i;
  }
}

TEST(LidarSensorTest, NamesGiveTheirRings) {
  EXPECT_EQ(LidarSensorByName("vlp16")->rings(), 16U);
  EXPECT_EQ(LidarSensorByName("hdl32")->rings(), 32U);
  EXPECT_EQ(LidarSensorByName("hdl64")->rings(), 64U);
  EXPECT_EQ(LidarSensorByName("h350")->columns, 350U);
  EXPECT_EQ(LidarSensorByName("vlp17").error().code(), StatusCode::kInvalidArgument);
  for (const char* name : {"vlp16", "hdl32", "hdl64", "h350"}) {
    const LidarSensor sensor = *LidarSensorByName(name);
    for (std::size_t ring = 1; ring < sensor.rings(); ++ring) {
      EXPECT_GT(sensor.elevations_rad[ring], sensor.elevations_rad[ring - 1]) << name << ring;
    }
  }
}

}  // namespace
}  // namespace atlas
