// Cities: the same whichever part is asked first, one ground for all passes, streets free to drive.
#include "core/simulation/city/city_world.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/simulation/city/city_ground.h"
#include "core/simulation/truth_label.h"

namespace atlas {
namespace {

// Down a street, around a block and down the same street again, half a metre higher.
Trajectory LoopedWay() {
  std::vector<Pose> poses;
  const auto add = [&](double x, double y, double yaw_rad, double z) {
    Pose pose = Pose::Identity();
    pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    pose.translation() = Eigen::Vector3d(x, y, z + 1.8);
    poses.push_back(pose);
  };
  for (const double z : {0.0, 0.5}) {
    for (int x = 0; x < 120; ++x) add(x, 0.0, 0.0, z + 0.02 * x);
    for (int y = 0; y < 60; ++y) add(120.0, y, M_PI / 2.0, z + 2.4);
    for (int x = 120; x > 0; --x) add(x, 60.0, M_PI, z + 0.02 * x);
    for (int y = 60; y > 0; --y) add(0.0, y, -M_PI / 2.0, z);
  }
  return PlanTrajectory(poses, {}).value();
}

DriveOptions Exact() {
  DriveOptions options;
  options.sensor.range_sigma_m = 0.0;
  options.sensor.columns = 360;
  return options;
}

TEST(CityWorldTest, ScansAreTheSameInAnyOrder) {
  const Trajectory way = LoopedWay();
  const auto forward = DriveCity(way, Exact());
  const auto backward = DriveCity(way, Exact());
  ASSERT_TRUE(forward.has_value() && backward.has_value());
  const std::vector<std::size_t> some = {0, 90, 200, 340, 500};
  std::vector<SimulatedScan> scans;
  for (const std::size_t i : some) {
    scans.push_back(forward->Scan(i));
  }
  for (std::size_t k = some.size(); k-- > 0;) {
    const SimulatedScan again = backward->Scan(some[k]);
    EXPECT_EQ(again.points, scans[k].points) << some[k];
    EXPECT_EQ(again.labels, scans[k].labels) << some[k];
  }
}

TEST(CityWorldTest, ThinningKeepsTheWorld) {
  Trajectory thin = LoopedWay();
  const auto whole = DriveCity(thin, Exact());
  thin.moments.erase(thin.moments.begin(), thin.moments.begin() + 200);
  const auto part = DriveCity(thin, Exact());
  ASSERT_TRUE(whole.has_value() && part.has_value());
  const ScanCaster caster(Exact().sensor);
  EXPECT_EQ(part->StillScan(20, caster).points, whole->StillScan(220, caster).points);
}

TEST(CityWorldTest, BothPassesStandOnOneGround) {
  const auto drive = DriveCity(LoopedWay(), Exact());
  ASSERT_TRUE(drive.has_value());
  const Pose& first = drive->sensor_pose(60);
  const Pose& second = drive->sensor_pose(60 + 360);
  ASSERT_NEAR((first.translation() - second.translation()).head<2>().norm(), 0.0, 1e-9);
  EXPECT_NEAR(first.translation().z(), second.translation().z(), 1e-4);
  EXPECT_NEAR(first.translation().z(), 0.02 * 60 + 0.25 + 1.8, 0.05);
}

TEST(CityWorldTest, SensorStandsAboveTheRoadAndSeesIt) {
  const auto drive = DriveCity(LoopedWay(), Exact());
  ASSERT_TRUE(drive.has_value());
  for (std::size_t i = 0; i < drive->scans(); i += 7) {
    const Eigen::Vector3d p = drive->sensor_pose(i).translation();
    const WorldHit hit =
        CastWorld(drive->still_world().Around(p, 5.0), p, -Eigen::Vector3f::UnitZ(), 10.0F);
    ASSERT_TRUE(hit.is_hit()) << i;
    ASSERT_NEAR(hit.hit.distance_m, 1.8F, 1e-3) << i;
    ASSERT_EQ(ClassOfLabel(hit.label()), TruthClass::kRoad) << i;
  }
}

TEST(CityWorldTest, NothingStandsOnTheWayOfAnyPass) {
  const auto drive = DriveCity(LoopedWay(), Exact());
  ASSERT_TRUE(drive.has_value());
  for (std::size_t i = 0; i + 1 < drive->scans(); i += 3) {
    const Eigen::Vector3d p = drive->sensor_pose(i).translation() - Eigen::Vector3d(0, 0, 1.2);
    const WorldParts parts = drive->still_world().Around(p, 5.0);
    for (const double yaw_rad : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}) {
      const Eigen::Vector3f around(static_cast<float>(std::cos(yaw_rad)),
                                   static_cast<float>(std::sin(yaw_rad)), 0.0F);
      ASSERT_FALSE(CastWorld(parts, p, around, 3.0F).is_hit()) << i << " " << yaw_rad;
    }
  }
}

TEST(CityWorldTest, CurbsStandTwelveCentimetresAboveTheParkingStrip) {
  const CityPath path(LoopedWay().legs, 1.8);
  const Eigen::Vector2d on_street(60.0, -CityStreet::kCurb_m);
  const CityGround ground(path, {on_street, on_street});
  const GroundPoint below = ground.At(on_street + Eigen::Vector2d(0.0, 0.02));
  const GroundPoint above = ground.At(on_street - Eigen::Vector2d(0.0, 0.02));
  EXPECT_NEAR(above.z_m() - below.z_m(), CityStreet::kCurbHeight_m, 1e-3);
  EXPECT_NEAR(below.street_m, CityStreet::kCurb_m - 0.02, 1e-9);
}

TEST(CityWorldTest, HoldsWhatACityHolds) {
  DriveOptions options = Exact();
  const auto drive = DriveCity(LoopedWay(), options);
  ASSERT_TRUE(drive.has_value());
  std::vector<std::uint32_t> seen;
  for (std::size_t i = 0; i < drive->scans(); i += 20) {
    const SimulatedScan scan = drive->Scan(i);
    seen.insert(seen.end(), scan.labels.begin(), scan.labels.end());
  }
  for (const TruthClass wanted :
       {TruthClass::kRoad, TruthClass::kParking, TruthClass::kSidewalk, TruthClass::kTerrain,
        TruthClass::kBuilding, TruthClass::kFence, TruthClass::kTrunk, TruthClass::kPole,
        TruthClass::kCar, TruthClass::kMovingCar}) {
    EXPECT_NE(std::find(seen.begin(), seen.end(), TruthLabel(wanted)), seen.end())
        << static_cast<int>(wanted);
  }
}

TEST(CityWorldTest, ATourNeedsNoTrajectory) {
  const auto drive = DriveCity(CityTour(Exact()), Exact());
  ASSERT_TRUE(drive.has_value());
  EXPECT_GT(drive->length_m(), 500.0);
}

TEST(CityWorldTest, FarFromTheOriginACityIsTheSame) {
  Trajectory near = LoopedWay();
  Trajectory far = near;
  const Eigen::Vector3d moved(6.4e6, -6.4e6, 300.0);  // whole chunks
  for (DriveMoment& moment : far.moments) moment.T_world_sensor.translation() += moved;
  for (auto& leg : far.legs) {
    for (Eigen::Vector3d& p : leg) p += moved;
  }
  const SimulatedScan here = DriveCity(near, Exact())->Scan(100);
  const SimulatedScan there = DriveCity(far, Exact())->Scan(100);
  ASSERT_EQ(here.points.size(), there.points.size());
  for (std::size_t i = 0; i < here.points.size(); ++i) {
    ASSERT_NEAR(here.points[i].x, there.points[i].x, 2e-3) << i;
  }
}

}  // namespace
}  // namespace atlas
