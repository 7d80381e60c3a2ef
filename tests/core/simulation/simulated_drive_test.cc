// Drives: the same on every run, on the surface, tilted as ramps are.
#include "core/simulation/simulated_drive.h"

#include <cmath>
#include <cstring>
#include <numbers>

#include <gtest/gtest.h>

#include "core/base/hash.h"
#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/mesh_builder.h"

namespace atlas {
namespace {

SimulatedDrive Drive(WorldKind kind, std::uint64_t seed = 0, double sigma_m = 0.02) {
  DriveOptions options;
  options.seed = seed;
  options.sensor.range_sigma_m = sigma_m;
  return SimulatedDrive::Create(MakeWorld(kind).value(), options).value();
}

std::uint64_t HashOf(const SimulatedScan& scan) {
  Bytes bytes(scan.points.size() * sizeof(SimulatedPoint));
  std::memcpy(bytes.data(), scan.points.data(), bytes.size());
  for (const std::uint32_t label : scan.labels) {
    bytes.push_back(static_cast<std::uint8_t>(label & 0xFF));
  }
  return Hash64(bytes);
}

TEST(SimulatedDriveTest, ScansAreTheSameOnEveryRunAndInAnyOrder) {
  const SimulatedDrive first = Drive(WorldKind::kStreet, 3);
  const SimulatedDrive second = Drive(WorldKind::kStreet, 3);
  const std::uint64_t late = HashOf(first.Scan(50));
  const std::uint64_t early = HashOf(first.Scan(20));
  EXPECT_EQ(HashOf(second.Scan(20)), early);
  EXPECT_EQ(HashOf(second.Scan(50)), late);
  EXPECT_NE(HashOf(Drive(WorldKind::kStreet, 5).Scan(20)), early);
}

TEST(SimulatedDriveTest, ScansKeepToTheSpacingAndTheModestCount) {
  for (const WorldKind kind : {WorldKind::kStreet, WorldKind::kOverpass, WorldKind::kGarage}) {
    const SimulatedDrive drive = Drive(kind);
    EXPECT_GE(drive.scans(), 150U);
    EXPECT_LE(drive.scans(), 250U);
    std::size_t jumps = 0;
    for (std::size_t i = 1; i < drive.scans(); ++i) {
      const double step_m =
          (drive.sensor_pose(i).translation() - drive.sensor_pose(i - 1).translation()).norm();
      jumps += step_m > 10.0 ? 1 : 0;
      EXPECT_LT(step_m, 6.0 * (drive.time_s(i) - drive.time_s(i - 1))) << "18 km/h";
      EXPECT_TRUE(step_m > 10.0 || (step_m > 0.9 && step_m < 1.5)) << i << ": " << step_m;
    }
    EXPECT_EQ(jumps, kind == WorldKind::kOverpass ? 1U : 0U);
  }
}

TEST(SimulatedDriveTest, SensorStands180CentimetresAboveTheSurface) {
  for (const WorldKind kind : {WorldKind::kStreet, WorldKind::kOverpass, WorldKind::kGarage}) {
    const SimulatedDrive drive = Drive(kind, 1);
    const WorldParts world = drive.still_world().Around({0.0, 0.0, 0.0}, 1e3);
    for (std::size_t i = 0; i < drive.scans(); ++i) {
      const WorldHit hit =
          CastWorld(world, drive.sensor_pose(i).translation(), -Eigen::Vector3f::UnitZ(), 10.0F);
      ASSERT_TRUE(hit.is_hit());
      ASSERT_NEAR(hit.hit.distance_m, 1.8F, 1e-3) << i;
      ASSERT_TRUE(IsGroundLabel(hit.label())) << i;
    }
  }
}

TEST(SimulatedDriveTest, PosesAreRotationsTiltedAsTheRampsAre) {
  const SimulatedDrive drive = Drive(WorldKind::kGarage);
  double steepest = 0.0;
  for (std::size_t i = 0; i < drive.scans(); ++i) {
    const Eigen::Matrix3d rotation = drive.sensor_pose(i).linear();
    ASSERT_NEAR((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 0.0, 1e-9);
    ASSERT_NEAR(rotation.determinant(), 1.0, 1e-9);
    steepest = std::max(steepest, rotation(2, 0) / std::hypot(rotation(0, 0), rotation(1, 0)));
  }
  EXPECT_NEAR(steepest, 3.2 / 19.5, 0.005);
  EXPECT_LT(steepest, 0.18);
}

TEST(SimulatedDriveTest, OddSeedsDriveTheOtherWayInTheOtherLane) {
  const SimulatedDrive forward = Drive(WorldKind::kStreet, 0);
  const SimulatedDrive backward = Drive(WorldKind::kStreet, 1);
  EXPECT_GT(forward.sensor_pose(3).linear()(0, 0), 0.9);
  const Pose& last = backward.sensor_pose(backward.scans() - 3);
  EXPECT_LT(last.linear()(0, 0), -0.9);
  const double apart_m = last.translation().y() - forward.sensor_pose(3).translation().y();
  EXPECT_NEAR(apart_m, 3.2, 0.35);
}

TEST(SimulatedDriveTest, MovingCarsMoveWithTheScans) {
  const SimulatedDrive drive = Drive(WorldKind::kStreet, 0, 0.0);
  const auto mean_ahead = [&](std::size_t i) {
    const SimulatedScan scan = drive.Scan(i);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (std::size_t k = 0; k < scan.points.size(); ++k) {
      const SimulatedPoint& p = scan.points[k];
      if (ClassOfLabel(scan.labels[k]) == TruthClass::kMovingCar && std::abs(p.y) < 1.5F &&
          p.x > 0.0F && p.x < 25.0F) {
        sum += drive.sensor_pose(i) * Eigen::Vector3d(p.x, p.y, p.z);
        ++count;
      }
    }
    EXPECT_GT(count, 20) << i;
    return Eigen::Vector3d(sum / count);
  };
  // The car ahead drives 5.3 m/s; twenty scans take 5 s.
  EXPECT_NEAR((mean_ahead(25) - mean_ahead(5)).head<2>().norm(), 26.5, 0.6);
}

TEST(SimulatedDriveTest, GroundReturnsLieOnTheGround) {
  const SimulatedDrive drive = Drive(WorldKind::kStreet);
  const SimulatedScan scan = drive.Scan(10);
  std::size_t road = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const TruthClass truth = ClassOfLabel(scan.labels[i]);
    if (truth == TruthClass::kRoad || truth == TruthClass::kParking) {
      ++road;
      ASSERT_NEAR(scan.points[i].z, -1.8F, 4.0 * 0.02) << i;
    }
  }
  EXPECT_GT(road, 3000U);
}

// Towards a wall, a metre and 0.05 rad a scan, at an even pace.
SimulatedDrive DriveTowardsAWall(double revolution_s) {
  MeshBuilder builder;
  builder.Quad({30.0, -300.0, -2.0}, {30.0, 300.0, -2.0}, {30.0, 300.0, 100.0},
               {30.0, -300.0, 100.0}, TruthLabel(TruthClass::kBuilding));
  TrajectoryWorld world;
  world.still = std::make_shared<const MeshWorld>(builder.Take());
  std::vector<DriveMoment> moments(8);
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const auto driven = static_cast<double>(i);
    moments[i].T_world_sensor.translation().x() = driven;
    moments[i].T_world_sensor.linear() =
        Eigen::AngleAxisd(0.05 * driven, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    moments[i].leg_time_s = 0.2 * driven;
  }
  DriveOptions options;
  options.scan_interval_s = 0.2;
  options.revolution_s = revolution_s;
  options.sensor.range_sigma_m = 0.0;
  return SimulatedDrive::Create(std::move(world), std::move(moments), options).value();
}

// Of the wall's returns, as if all had been seen from the scan's pose.
double FurthestFromTheWall(const SimulatedDrive& drive, std::size_t i) {
  double furthest_m = 0.0;
  for (const SimulatedPoint& p : drive.Scan(i).points) {
    const Eigen::Vector3d p_world = drive.sensor_pose(i) * Eigen::Vector3d(p.x, p.y, p.z);
    furthest_m = std::max(furthest_m, std::abs(p_world.x() - 30.0));
  }
  return furthest_m;
}

TEST(SimulatedDriveTest, ATurningSensorCastsEachColumnFromWhereItIsThen) {
  for (const double revolution_s : {0.2, 0.1}) {
    const SimulatedDrive drive = DriveTowardsAWall(revolution_s);
    for (const std::size_t i : {0U, 3U, 7U}) {
      EXPECT_GT(FurthestFromTheWall(drive, i), 0.05) << i;
      const SimulatedScan scan = drive.Scan(i);
      ASSERT_GT(scan.points.size(), 5000U);
      for (const SimulatedPoint& p : scan.points) {
        // Clockwise: to the right, where azimuths are negative, it looks later.
        const double later_s = -std::atan2(p.y, p.x) / (2.0 * std::numbers::pi) * revolution_s;
        const double driven = static_cast<double>(i) + later_s / 0.2;
        const double world_azimuth_rad = std::atan2(p.y, p.x) + 0.05 * driven;
        const double x_then = drive.SensorPoseAfter(i, later_s).translation().x();
        ASSERT_NEAR(x_then, driven, 0.02) << "an arc that is nearly straight";
        ASSERT_NEAR(x_then + std::hypot(p.x, p.y) * std::cos(world_azimuth_rad), 30.0, 2e-3) << i;
      }
    }
  }
  EXPECT_LT(FurthestFromTheWall(DriveTowardsAWall(0.0), 3), 1e-3);
}

TEST(SimulatedDriveTest, RefusesOptionsOutOfRange) {
  const auto code = [](auto change) {
    DriveOptions options;
    change(options);
    const auto drive = SimulatedDrive::Create(MakeOverpassWorld(), options);
    return drive ? StatusCode::kOk : drive.error().code();
  };
  EXPECT_EQ(code([](DriveOptions& o) { o.spacing_m = 0.0; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](DriveOptions& o) { o.spacing_m = NAN; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](DriveOptions& o) { o.revolution_s = 0.3; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](DriveOptions& o) { o.revolution_s = NAN; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](DriveOptions& o) { o.sensor_height_m = -1.0; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](DriveOptions& o) { o.sensor.elevations_rad.clear(); }),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](DriveOptions& o) { o.sensor.range_sigma_m = 9.0; }),
            StatusCode::kInvalidArgument);
}

TEST(SimulatedDriveTest, AMeshFarFromTheOriginIsMeasuredAsWellAsANearOne) {
  MeshBuilder builder;
  builder.Floor({{-50.0, -50.0, 0.0}, {50.0, 50.0, 0.0}}, TruthLabel(TruthClass::kRoad));
  const Eigen::Vector3d far_m(3'000'000.0, -5'000'000.0, 400.0);
  DriveMoment moment;
  moment.T_world_sensor.translation() = far_m + Eigen::Vector3d(0.3, 0.7, 1.8);
  DriveOptions options;
  options.sensor.range_sigma_m = 0.0;
  TrajectoryWorld world;
  world.still = std::make_shared<const MeshWorld>(builder.Take(), far_m);
  const auto drive = SimulatedDrive::Create(std::move(world), {moment}, options);
  ASSERT_TRUE(drive.has_value());
  EXPECT_EQ(drive->sensor_pose(0).translation(), moment.T_world_sensor.translation());
  const SimulatedScan scan = drive->Scan(0);
  ASSERT_GT(scan.points.size(), 5000U);
  for (const SimulatedPoint& p : scan.points) {
    ASSERT_NEAR(p.z, -1.8F, 1e-4);
  }
}

TEST(SimulatedDriveTest, ALaneBesideTheWorldIsAnError) {
  SimulatedWorld world = MakeOverpassWorld();
  world.lane_left_m = 500.0;
  const auto drive = SimulatedDrive::Create(std::move(world), {});
  ASSERT_FALSE(drive.has_value());
  EXPECT_EQ(drive.error().code(), StatusCode::kInternal);
}

}  // namespace
}  // namespace atlas
