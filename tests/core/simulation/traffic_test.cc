// Cars that move and cars that come and go, against what the scans see of them.
#include "core/simulation/traffic.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/simulation/simulated_drive.h"
#include "core/simulation/surface_pose.h"
#include "core/simulation/truth_label.h"

namespace atlas {
namespace {

SimulatedDrive Street(std::uint64_t seed, std::uint64_t parked_seed) {
  DriveOptions options;
  options.seed = seed;
  options.parked_seed = parked_seed;
  options.sensor.range_sigma_m = 0.0;
  return SimulatedDrive::Create(MakeStreetWorld(), options).value();
}

bool IsInAny(const std::vector<TruthBox>& boxes, const Eigen::Vector3d& p) {
  return std::any_of(boxes.begin(), boxes.end(),
                     [&](const TruthBox& box) { return box.Contains(p, 0.01); });
}

template <typename Use>
void ForEachReturn(const SimulatedDrive& drive, std::size_t i, const Use& use) {
  const SimulatedScan scan = drive.Scan(i);
  for (std::size_t k = 0; k < scan.points.size(); ++k) {
    const SimulatedPoint& p = scan.points[k];
    use(drive.sensor_pose(i) * Eigen::Vector3d(p.x, p.y, p.z), scan.labels[k]);
  }
}

TEST(TrafficTest, EveryMovingReturnLiesInABoxOfItsScan) {
  const SimulatedDrive drive = Street(3, 0);
  std::size_t moving = 0;
  for (const std::size_t i : {0U, 20U, 50U, 90U}) {
    const std::vector<TruthBox> boxes = drive.moving_boxes(i);
    ForEachReturn(drive, i, [&](const Eigen::Vector3d& p_world, std::uint32_t label) {
      moving += IsMovingLabel(label) ? 1U : 0U;
      if (!IsGroundLabel(label)) {  // boxes begin at the ground
        ASSERT_EQ(IsMovingLabel(label), IsInAny(boxes, p_world)) << i;
      }
    });
  }
  EXPECT_GT(moving, 500U);
}

TEST(TrafficTest, SeedZeroParksNothing) {
  EXPECT_TRUE(Street(0, 0).parked_boxes().empty());
}

TEST(TrafficTest, AParkedCarIsThereInOneDriveAndGoneInAnother) {
  const SimulatedDrive with = Street(0, 1);
  const SimulatedDrive without = Street(0, 0);
  ASSERT_GT(with.parked_boxes().size(), 3U);
  std::size_t seen = 0;
  ForEachReturn(with, 60, [&](const Eigen::Vector3d& p_world, std::uint32_t label) {
    if (IsInAny(with.parked_boxes(), p_world) && ClassOfLabel(label) == TruthClass::kCar) ++seen;
  });
  EXPECT_GT(seen, 100U);
  ForEachReturn(without, 60, [&](const Eigen::Vector3d& p_world, std::uint32_t label) {
    if (ClassOfLabel(label) == TruthClass::kCar) {
      ASSERT_FALSE(IsInAny(with.parked_boxes(), p_world));
    }
  });
}

TEST(TrafficTest, ParkedSeedsDifferAndDoNotFollowTheDrivesSeed) {
  const auto places = [](const SimulatedDrive& drive) {
    std::vector<double> x;
    for (const TruthBox& box : drive.parked_boxes()) x.push_back(box.T_world_box.translation().x());
    return x;
  };
  EXPECT_EQ(places(Street(0, 1)), places(Street(4, 1)));
  EXPECT_NE(places(Street(0, 1)), places(Street(0, 2)));
}

TEST(TrafficTest, NothingDrivesThroughTheVehicle) {
  const DrivePath road = DrivePath({{0.0, 0.0, 0.0}, 0.0}).Straight(100.0);
  TrafficParticipant car{MakeStreetWorld().traffic[0].mesh, 0, true, 0.0, 10.0, 0.0, false};
  const Traffic traffic({car}, {road}, {road.Reversed()}, {}, {});
  std::size_t there = 0;
  for (int i = 0; i < 100; ++i) {
    DriveMoment moment;
    moment.leg_time_s = 0.1 * i;
    moment.T_world_sensor.translation() = Eigen::Vector3d(50.0, 0.0, 1.8);
    for (const TruthBox& box : traffic.MovingBoxes(moment, 100.0)) {
      ++there;
      ASSERT_FALSE(box.Contains({50.0, 0.0, 0.5}, 1.0));
    }
  }
  EXPECT_GT(there, 80U);
}

TEST(TrafficTest, ALeadingCarKeepsItsDistance) {
  const DrivePath road = DrivePath({{0.0, 0.0, 0.0}, 0.0}).Straight(100.0);
  TrafficParticipant car{MakeStreetWorld().traffic[0].mesh, 0, false, 20.0, 0.0, 0.0, true};
  const Traffic traffic({car}, {road}, {road.Reversed()}, {}, {});
  DriveMoment moment;
  moment.along_m = 30.0;
  moment.leg_time_s = 99.0;
  ASSERT_EQ(traffic.MovingBoxes(moment, 100.0).size(), 1U);
  EXPECT_NEAR(traffic.MovingBoxes(moment, 100.0)[0].T_world_box.translation().x(), 50.0, 0.1);
  EXPECT_TRUE(traffic.MovingBoxes(moment, 40.0).empty()) << "out of reach";
  moment.along_m = 90.0;
  EXPECT_TRUE(traffic.MovingBoxes(moment, 100.0).empty());
}

// The highest and the lowest a wheel's foot stands above the ground below it.
Eigen::Vector2d Clearance(const SimulatedDrive& drive, const TruthBox& box) {
  Eigen::Vector2d high_low(-1.0, 1.0);
  for (const double x : {-1.35, 1.35}) {
    for (const double y : {-0.75, 0.75}) {
      const Eigen::Vector3d foot = box.T_world_box * Eigen::Vector3d(x, y, -0.5 * box.size_m.z());
      const auto ground = SurfaceNear(drive.still_world().Around(foot, 10.0), foot);
      const double up_m = foot.z() - ground.value().z();
      high_low = {std::max(high_low.x(), up_m), std::min(high_low.y(), up_m)};
    }
  }
  return high_low;
}

TEST(TrafficTest, AConvoyStandsOnEachDeckAndTiltsWithItsRamps) {
  DriveOptions options;
  options.convoy = {kCarAhead, kCarBehind};
  options.spacing_m = 5.0;
  const SimulatedDrive drive =
      SimulatedDrive::Create(MakeWorld(WorldKind::kGarage).value(), options).value();
  std::size_t ahead = 0;
  std::size_t behind = 0;
  double steepest = 0.0;
  double highest_m = 0.0;
  for (std::size_t i = 0; i < drive.scans(); ++i) {
    for (const TruthBox& box : drive.moving_boxes(i)) {
      const Eigen::Vector2d clearance = Clearance(drive, box);
      EXPECT_LT(clearance.x(), 0.05) << i;  // on the kinks of a ramp
      EXPECT_GT(clearance.y(), -0.05) << i;
      steepest = std::max(steepest, std::acos(box.T_world_box.linear()(2, 2)));
      highest_m = std::max(highest_m, box.T_world_box.translation().z());
      const Eigen::Vector3d p_sensor =
          drive.sensor_pose(i).inverse() * box.T_world_box.translation();
      EXPECT_LT(p_sensor.norm(), 15.0) << i;
      ++(p_sensor.x() > 0.0 ? ahead : behind);
    }
  }
  EXPECT_GT(ahead, drive.scans() * 3 / 4);
  EXPECT_GT(behind, drive.scans() * 2 / 3);
  EXPECT_GT(steepest, 0.1);
  EXPECT_GT(highest_m, 7.0);
}

// On the way as driven, not on the leg's middle; and nowhere where the way has no more ground.
TEST(TrafficTest, AConvoyKeepsToTheVehiclesLane) {
  DriveOptions options;
  options.convoy = {{10.0, 0.0}};
  options.spacing_m = 10.0;
  SimulatedWorld world = MakeStreetWorld();
  world.traffic.clear();
  const SimulatedDrive drive = SimulatedDrive::Create(std::move(world), options).value();
  for (std::size_t i = 0; i + 1 < drive.scans(); ++i) {
    const std::vector<TruthBox> boxes = drive.moving_boxes(i);
    ASSERT_EQ(boxes.size(), 1U) << i;
    const Eigen::Vector3d away =
        boxes[0].T_world_box.translation() - drive.sensor_pose(i + 1).translation();
    EXPECT_LT(away.head<2>().norm(), 0.1) << i;
  }
}

TEST(TrafficTest, AWorldWithoutLegsHasNoConvoy) {
  TrajectoryWorld world;
  world.still = std::make_shared<const MeshWorld>(TriangleMesh());
  DriveOptions options;
  options.convoy = {kCarAhead};
  const auto drive = SimulatedDrive::Create(std::move(world), {DriveMoment()}, options);
  ASSERT_TRUE(drive.has_value());
  EXPECT_TRUE(drive->moving_boxes(0).empty());
}

}  // namespace
}  // namespace atlas
