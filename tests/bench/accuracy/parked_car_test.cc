// A car that was parked during one visit and is gone by the next.
#include <algorithm>
#include <iostream>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/str_cat.h"
#include "core/simulation/city/city_world.h"
#include "core/simulation/truth_label.h"
#include "tests/bench/accuracy/accuracy_score.h"
#include "tests/bench/accuracy/drive_map.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kScans = 120;
constexpr std::int64_t kDay_ms = 86'400'000;

DriveOptions OptionsOf(std::uint64_t day) {
  DriveOptions options;
  options.seed = 2 * day;
  options.parked_seed = day;
  return options;
}

SimulatedDrive VisitCity(std::uint64_t day) {
  return DriveCity(CityTour(OptionsOf(day)), OptionsOf(day)).value();
}

// A level place without walls that ends `edge_m` to the right of the way, as a roof or a quay does;
// cars are parked 4.1 to 5.9 m from the way.
SimulatedDrive VisitEdge(std::uint64_t day, double edge_m) {
  TriangleMesh mesh;
  for (const Eigen::Vector2d& corner :
       {Eigen::Vector2d(-100.0, -edge_m), {100.0, -edge_m}, {100.0, 60.0}, {-100.0, 60.0}}) {
    mesh.vertices.emplace_back(static_cast<float>(corner.x()), static_cast<float>(corner.y()),
                               0.0F);
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.labels.assign(2, TruthLabel(TruthClass::kRoad));
  TrajectoryWorld world;
  world.still = std::make_shared<const MeshWorld>(std::move(mesh));
  for (int i = -3; i <= 3; ++i) {
    ParkedSlot slot;
    slot.T_world_car.translation() = Eigen::Vector3d(7.0 * i, -5.0, 0.0);
    world.parked_slots.push_back(slot);
  }
  std::vector<DriveMoment> moments;
  for (int i = 0; i < 60; ++i) {
    DriveMoment moment;
    moment.T_world_sensor.translation() = Eigen::Vector3d(i - 30.0, 0.0, 1.8);
    moment.leg_time_s = 0.2 * i;
    moments.push_back(moment);
  }
  return SimulatedDrive::Create(std::move(world), std::move(moments), OptionsOf(day)).value();
}

std::vector<PlacedKeyframe> Keyframes(const SimulatedDrive& drive,
                                      std::int64_t day,
                                      const MapProfile& profile) {
  const std::size_t scans = std::min(kScans, drive.scans());
  auto keyframes = BuildKeyframes(drive, 0, scans, profile, 20.0).value();
  for (PlacedKeyframe& keyframe : keyframes) {
    keyframe.key.session.session = StrCat("day.", day);
    keyframe.time_ms += day * kDay_ms;
  }
  return keyframes;
}

bool IsParked(const TruthBox& box, std::span<const TruthBox> others) {
  return std::any_of(others.begin(), others.end(), [&](const TruthBox& other) {
    return other.Contains(box.T_world_box.translation());
  });
}

// Cells whose middle lies in the box, from above.
std::vector<MapCell> CellsOf(const TruthBox& box, double cell_m) {
  const Eigen::Vector3d middle = box.T_world_box.translation();
  const double reach_m = 0.5 * box.size_m.head<2>().norm();
  const MapCell low = MapCell::At(middle - Eigen::Vector3d::Constant(reach_m), cell_m);
  const MapCell high = MapCell::At(middle + Eigen::Vector3d::Constant(reach_m), cell_m);
  std::vector<MapCell> cells;
  for (std::int32_t y = low.y; y <= high.y; ++y) {
    for (std::int32_t x = low.x; x <= high.x; ++x) {
      const Eigen::Vector2d centre = MapCell{x, y}.Centre(cell_m);
      if (box.Contains({centre.x(), centre.y(), middle.z()})) {
        cells.push_back({x, y});
      }
    }
  }
  return cells;
}

// Of the cells of parked cars that are occupied in `before`, how many are not in `after`.
Share Gone(std::span<const TruthBox> cars, const DriveMap& before, const DriveMap& after) {
  Share gone;
  for (const TruthBox& car : cars) {
    const double ground_m = car.T_world_box.translation().z() - 0.5 * car.size_m.z();
    for (const MapCell& cell : CellsOf(car, 0.1)) {
      if (IsOccupied(before, cell, ground_m, 0.3, 2.0)) {
        gone.Add(!IsOccupied(after, cell, ground_m, 0.3, 2.0));
      }
    }
  }
  return gone;
}

// Two visits, and which of the first one's cars are there at the second.
struct TwoDays {
  std::vector<TruthBox> left;
  std::vector<TruthBox> stayed;
  std::vector<PlacedKeyframe> first;
  std::vector<PlacedKeyframe> both;
};

TwoDays DriveTwoDays(const SimulatedDrive& first, const SimulatedDrive& second) {
  TwoDays days;
  for (const TruthBox& car : first.parked_boxes()) {
    (IsParked(car, second.parked_boxes()) ? days.stayed : days.left).push_back(car);
  }
  days.first = Keyframes(first, 1, {});
  days.both = Keyframes(second, 2, {});
  days.both.insert(days.both.end(), days.first.begin(), days.first.end());
  return days;
}

// Shares of the cells that cars occupied: of those that left, of those that stayed.
struct GoneCells {
  Share left;
  Share stayed;
};

GoneCells Compare(const TwoDays& days, FusionPreset preset) {
  MapProfile profile;
  profile.preset = preset;
  const DriveMap before(days.first, profile);
  const DriveMap after(days.both, profile);
  const GoneCells gone = {Gone(days.left, before, after), Gone(days.stayed, before, after)};
  std::cout << "cells of cars that left: " << gone.left.whole << ", gone " << gone.left.value()
            << "; of cars that stayed: " << gone.stayed.whole << ", gone " << gone.stayed.value()
            << "\n";
  return gone;
}

class ParkedCarTest : public ::testing::TestWithParam<FusionPreset> {};

TEST_P(ParkedCarTest, IsGoneAfterTheNextVisitAndTheOthersStay) {
  static const TwoDays days = DriveTwoDays(VisitCity(1), VisitCity(2));
  const GoneCells gone = Compare(days, GetParam());
  EXPECT_GT(gone.left.whole, 500U);
  EXPECT_GT(gone.stayed.whole, 500U);
  EXPECT_GT(gone.left.value(), 0.99);
  EXPECT_LT(gone.stayed.value(), 0.01);
}

// Where the ground ends, and how much of what stood there is to be gone: nothing is seen behind it
// that is far enough for a ray to have passed above where it stood. At 6 m 0.1 m are left.
TEST_P(ParkedCarTest, IsGoneWithNothingBehindIt) {
  struct Edge {
    double edge_m;
    double gone;
  };
  for (const auto& [edge_m, asked] : {Edge{6.0, 0.95}, {8.0, 0.99}, {12.0, 0.99}, {60.0, 0.99}}) {
    const TwoDays days = DriveTwoDays(VisitEdge(1, edge_m), VisitEdge(2, edge_m));
    const GoneCells gone = Compare(days, GetParam());
    EXPECT_GT(gone.left.whole, 300U) << edge_m;
    EXPECT_GT(gone.stayed.whole, 300U) << edge_m;
    EXPECT_GT(gone.left.value(), asked) << edge_m;
    EXPECT_LT(gone.stayed.value(), 0.01) << edge_m;
  }
}

INSTANTIATE_TEST_SUITE_P(Presets,
                         ParkedCarTest,
                         ::testing::Values(FusionPreset::kStrict, FusionPreset::kBounded));

}  // namespace
}  // namespace atlas::testing
