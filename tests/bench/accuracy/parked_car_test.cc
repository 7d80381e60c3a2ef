// A car that was parked during one visit and is gone by the next.
#include <algorithm>
#include <iostream>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/str_cat.h"
#include "core/simulation/city/city_world.h"
#include "tests/bench/accuracy/accuracy_score.h"
#include "tests/bench/accuracy/drive_map.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kScans = 120;
constexpr std::int64_t kDay_ms = 86'400'000;

SimulatedDrive Visit(std::uint64_t day) {
  DriveOptions options;
  options.seed = 2 * day;
  options.parked_seed = day;
  return DriveCity(CityTour(options), options).value();
}

std::vector<PlacedKeyframe> Keyframes(const SimulatedDrive& drive,
                                      std::int64_t day,
                                      const MapProfile& profile) {
  auto keyframes = BuildKeyframes(drive, 0, kScans, profile, 20.0).value();
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

TwoDays DriveTwoDays() {
  TwoDays days;
  const SimulatedDrive first = Visit(1);
  const SimulatedDrive second = Visit(2);
  for (const TruthBox& car : first.parked_boxes()) {
    (IsParked(car, second.parked_boxes()) ? days.stayed : days.left).push_back(car);
  }
  days.first = Keyframes(first, 1, {});
  days.both = Keyframes(second, 2, {});
  days.both.insert(days.both.end(), days.first.begin(), days.first.end());
  return days;
}

class ParkedCarTest : public ::testing::TestWithParam<FusionPreset> {};

TEST_P(ParkedCarTest, IsGoneAfterTheNextVisitAndTheOthersStay) {
  static const TwoDays days = DriveTwoDays();
  MapProfile profile;
  profile.preset = GetParam();
  const DriveMap before(days.first, profile);
  const DriveMap after(days.both, profile);
  const Share gone = Gone(days.left, before, after);
  const Share lost = Gone(days.stayed, before, after);
  std::cout << "cells of cars that left: " << gone.whole << ", gone " << gone.value()
            << "; of cars that stayed: " << lost.whole << ", gone " << lost.value() << "\n";
  EXPECT_GT(gone.whole, 500U);
  EXPECT_GT(lost.whole, 500U);
  EXPECT_GT(gone.value(), 0.99);
  EXPECT_LT(lost.value(), 0.03);
}

INSTANTIATE_TEST_SUITE_P(Presets,
                         ParkedCarTest,
                         ::testing::Values(FusionPreset::kStrict, FusionPreset::kBounded));

}  // namespace
}  // namespace atlas::testing
