// Small worlds that changed since they were mapped, driven through.
#include "core/localization/monitor/map_monitor.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::Box;
using testing::CastLeveledScan;
using testing::GroundLayer;
using testing::PaintedMap;
using testing::Patch;
using testing::ShapeWorld;
using testing::UprightPose;

using Contradictions = std::vector<Contradiction>;

constexpr double kSensor_m = 1.8;
constexpr double kCell_m = 0.1;

PoseCovariance SureOfPlace() {
  return Eigen::Vector4d(1e-4, 1e-4, 1e-4, 1e-6).asDiagonal();
}

PaintedMap MapOf(const ShapeWorld& world, double half_m = 25.0) {
  PaintedMap map;
  map.Paint(world, half_m);
  return map;
}

// A plain with a house to either side of the way, which is the x axis.
ShapeWorld Houses() {
  ShapeWorld world;
  world.patches = {Patch{}};
  world.boxes = {Box{{-6.05, 6.05, -1.0}, {6.05, 12.05, 6.0}},
                 Box{{-6.05, -12.05, -1.0}, {6.05, -6.05, 6.0}}};
  return world;
}

Box CarAt(double x, double y) {
  return Box{{x - 2.0, y - 0.9, -0.1}, {x + 2.0, y + 0.9, 1.5}};
}

struct Drive {
  double ground_m = 0.0;
  int scans = 16;
  double step_m = 1.0;
  double offset_m = 0.0;  // of the pose that is reported, to the left
};

// From x = -8 m on, each scan one of `world(scan)`.
template <typename WorldAt>
Contradictions Watch(const PaintedMap& map, const WorldAt& world, const Drive& drive = {}) {
  Contradictions found;
  MapMonitor monitor(map.profile(), map.Source(), {},
                     [&found](const Contradiction& c) { found.push_back(c); });
  for (int i = 0; i < drive.scans; ++i) {
    const Pose truth =
        UprightPose({-8.0 + i * drive.step_m, 0.0, drive.ground_m + kSensor_m}, 0.01 * i);
    Pose reported = truth;
    reported.translation().y() += drive.offset_m;
    const LeveledScan scan = CastLeveledScan(testing::QuickSensor(), world(i), truth);
    EXPECT_TRUE(monitor.Observe(scan, reported, SureOfPlace(), static_cast<std::uint32_t>(i)).ok());
  }
  monitor.Finish();
  return found;
}

Contradictions Watch(const PaintedMap& map, const ShapeWorld& world, const Drive& drive = {}) {
  return Watch(
      map, [&world](int) -> const ShapeWorld& { return world; }, drive);
}

Eigen::Vector2d PlaceOf(const Contradiction& c) {
  return kCell_m *
         Eigen::Vector2d(static_cast<double>(c.cell_x) + 0.5, static_cast<double>(c.cell_y) + 0.5);
}

std::size_t Count(const Contradictions& found, ContradictionKind kind) {
  return static_cast<std::size_t>(
      std::count_if(found.begin(), found.end(), [kind](const auto& c) { return c.kind == kind; }));
}

// How many of a kind lie within `margin_m` of a box, in plan.
std::size_t CountAt(const Contradictions& found,
                    ContradictionKind kind,
                    const Box& box,
                    double margin_m = 0.15) {
  return static_cast<std::size_t>(std::count_if(found.begin(), found.end(), [&](const auto& c) {
    const Eigen::Vector2d p = PlaceOf(c);
    return c.kind == kind && (p.array() > box.low.head<2>().array() - margin_m).all() &&
           (p.array() < box.high.head<2>().array() + margin_m).all();
  }));
}

TEST(MapMonitorTest, NothingIsSaidOfAWorldThatIsAsItWasMapped) {
  const ShapeWorld world = Houses();
  EXPECT_TRUE(Watch(MapOf(world), world).empty());
  const ShapeWorld street = testing::Street();
  EXPECT_LE(Watch(testing::StreetMap(), street, {.ground_m = 0.0}).size(), 3U);
}

TEST(MapMonitorTest, AWallThatIsGoneVanished) {
  ShapeWorld now = Houses();
  now.boxes[1] = Box{{-30.0, -20.05, -1.0}, {30.0, -18.05, 8.0}};  // rays end at it now
  ShapeWorld mapped = now;
  mapped.boxes.push_back(Houses().boxes[1]);
  const Contradictions found = Watch(MapOf(mapped), now);
  EXPECT_EQ(Count(found, ContradictionKind::kVanished),
            CountAt(found, ContradictionKind::kVanished, mapped.boxes[2]));
  // Its face of 12.1 m towards the way, and more.
  EXPECT_GT(CountAt(found, ContradictionKind::kVanished, mapped.boxes[2]), 110U);
  EXPECT_EQ(Count(found, ContradictionKind::kMoving), 0U);
  for (const Contradiction& c : found) {
    EXPECT_EQ(c.altitude_mm, 0);
    EXPECT_GE(c.low_mm, 0);
    EXPECT_GT(c.high_mm, c.low_mm);
    EXPECT_GT(c.passes, c.hits);
    EXPECT_LE(c.first_scan, c.last_scan);
  }
}

// Its bonnet reaches 0.05 m into a segment that rays pass through.
TEST(MapMonitorTest, TheTopOfWhatStandsHasNotVanished) {
  ShapeWorld world = Houses();
  world.boxes.push_back(Box{{1.05, 2.55, -0.1}, {5.05, 4.35, 1.06}});
  EXPECT_TRUE(Watch(MapOf(world), world).empty());
}

TEST(MapMonitorTest, ABoxThatIsNewAppeared) {
  const ShapeWorld mapped = Houses();
  ShapeWorld now = mapped;
  now.boxes.push_back(CarAt(3.0, 3.5));
  const Contradictions found = Watch(MapOf(mapped), now);
  EXPECT_EQ(found.size(), CountAt(found, ContradictionKind::kAppeared, now.boxes.back()));
  // Four metres of side are forty cells.
  EXPECT_GT(found.size(), 40U);
  for (const Contradiction& c : found) {
    EXPECT_GE(c.low_mm, 0);
    EXPECT_LE(c.high_mm, 2'000);
    EXPECT_GE(c.hits, 2U);
  }
}

TEST(MapMonitorTest, WhatIsSeenFromOneSideOnlyIsReportedThere) {
  const ShapeWorld mapped = Houses();
  ShapeWorld now = mapped;
  now.boxes.push_back(CarAt(3.0, 3.5));
  const Contradictions found = Watch(MapOf(mapped), now);
  const Box far_side{{1.2, 4.25, 0.0}, {4.8, 4.55, 1.5}};
  EXPECT_EQ(CountAt(found, ContradictionKind::kAppeared, far_side, 0.0), 0U);
}

TEST(MapMonitorTest, NothingIsSaidOfWhatWasNeverMapped) {
  PaintedMap map;  // a strip along the way, 3 m to either side
  const ShapeWorld mapped = Houses();
  for (std::int64_t y = -30; y < 30; ++y) {
    for (std::int64_t x = -200; x < 200; ++x) {
      map.Put(x, y, GroundLayer(0.0));
    }
  }
  ShapeWorld now = mapped;
  now.boxes.push_back(CarAt(3.0, 2.2));  // on ground that was mapped, but not what is above it
  EXPECT_TRUE(Watch(map, now).empty());
  EXPECT_TRUE(Watch(PaintedMap(), now).empty());
}

TEST(MapMonitorTest, WhatPassesByMoves) {
  const ShapeWorld mapped = Houses();
  const PaintedMap map = MapOf(mapped);
  const auto oncoming = [&mapped](int scan) {
    ShapeWorld now = mapped;
    now.boxes.push_back(CarAt(16.0 - 1.5 * scan, 3.0));
    return now;
  };
  const Contradictions found = Watch(map, oncoming, {.scans = 30, .step_m = 0.5});
  const auto moving = Count(found, ContradictionKind::kMoving);
  EXPECT_GT(moving, 20U);
  EXPECT_LT(Count(found, ContradictionKind::kAppeared), moving / 4);
  EXPECT_EQ(Count(found, ContradictionKind::kVanished), 0U);
}

TEST(MapMonitorTest, WhatFollowsTheVehicleMoves) {
  const ShapeWorld mapped = Houses();
  const auto follower = [&mapped](int scan) {
    ShapeWorld now = mapped;
    const double x = -8.0 + 0.3 * scan - 5.0;
    now.boxes.push_back(Box{{x - 0.9, -0.4, 0.0}, {x + 0.9, 0.4, 1.7}});
    return now;
  };
  const Contradictions found = Watch(MapOf(mapped), follower, {.scans = 40, .step_m = 0.3});
  const Box driven{{-8.0, -0.6, 0.0}, {4.0, 0.6, 2.0}};
  EXPECT_EQ(CountAt(found, ContradictionKind::kAppeared, driven), 0U);
  EXPECT_GT(CountAt(found, ContradictionKind::kMoving, driven), 0U);
}

TEST(MapMonitorTest, APoseThatIsOffByThreeCentimetresSaysNothingNew) {
  const ShapeWorld mapped = Houses();
  const PaintedMap map = MapOf(mapped);
  EXPECT_TRUE(Watch(map, mapped, {.offset_m = 0.03}).empty());
  ShapeWorld now = mapped;
  now.boxes.push_back(CarAt(3.0, 3.5));
  const Contradictions found = Watch(map, now, {.offset_m = 0.03});
  EXPECT_EQ(found.size(), CountAt(found, ContradictionKind::kAppeared, now.boxes.back()));
  EXPECT_GT(found.size(), 40U);
}

TEST(MapMonitorTest, AScanOfUncertainPlaceIsNoWitness) {
  const ShapeWorld mapped = Houses();
  ShapeWorld now = mapped;
  now.boxes.push_back(CarAt(3.0, 3.5));
  const PaintedMap map = MapOf(mapped);
  MapMonitor monitor(map.profile(), map.Source(), {},
                     [](const Contradiction&) { ADD_FAILURE() << "of no witness"; });
  PoseCovariance wide = SureOfPlace();
  wide(0, 0) = 1.0;
  PoseCovariance turned = SureOfPlace();
  turned(3, 3) = 1.0;
  for (std::uint32_t i = 0; i < 10; ++i) {
    const Pose pose = UprightPose({-8.0 + i, 0.0, kSensor_m}, 0.0);
    const LeveledScan scan = CastLeveledScan(testing::QuickSensor(), now, pose);
    EXPECT_TRUE(monitor.Observe(scan, pose, i % 2 == 0 ? wide : turned, i).ok());
  }
  monitor.Finish();
  EXPECT_EQ(monitor.scans(), 0U);
}

TEST(MapMonitorTest, AChangeOnTheUpperDeckIsNotReportedOnTheLowerOne) {
  const ShapeWorld mapped = testing::GarageCorner();
  ShapeWorld now = mapped;
  now.boxes.push_back(Box{{-1.05, 2.45, 3.0}, {2.95, 4.25, 4.5}});  // a car on the upper deck
  const Box& car = now.boxes.back();
  const Contradictions above =
      Watch(testing::GarageMap(), now, {.ground_m = 3.0, .scans = 12, .step_m = 0.8});
  EXPECT_GT(CountAt(above, ContradictionKind::kAppeared, car), 20U);
  for (const Contradiction& c : above) {
    EXPECT_EQ(c.altitude_mm, 3'000);
    EXPECT_GE(c.low_mm, 3'000);
  }
  const Contradictions below = Watch(testing::GarageMap(), now, {.scans = 12, .step_m = 0.8});
  EXPECT_EQ(CountAt(below, ContradictionKind::kAppeared, car), 0U);
  EXPECT_LE(below.size(), 3U);
}

// Every `step`-th return, over and over; a step of 1 leaves them as they are.
LeveledScan Reordered(const LeveledScan& scan, std::size_t step) {
  EXPECT_EQ(std::gcd(step, scan.size()), 1U);
  LeveledScan other;
  for (std::size_t k = 0; k < scan.size(); ++k) {
    const std::size_t from = k * step % scan.size();
    testing::AddReturn(other, {scan.x[from], scan.y[from], scan.z[from]},
                       scan.is_ground[from] != 0);
  }
  return other;
}

TEST(MapMonitorTest, TheOrderOfRaysDoesNotMatter) {
  const ShapeWorld mapped = Houses();
  ShapeWorld now = mapped;
  now.boxes.pop_back();
  now.boxes.push_back(CarAt(3.0, 3.5));
  const PaintedMap map = MapOf(mapped);
  const auto watch = [&](bool is_shuffled) {
    Contradictions found;
    MapMonitor monitor(map.profile(), map.Source(), {},
                       [&found](const Contradiction& c) { found.push_back(c); });
    for (std::uint32_t i = 0; i < 8; ++i) {
      const Pose pose = UprightPose({-4.0 + i, 0.0, kSensor_m}, 0.0);
      const LeveledScan cast = CastLeveledScan(testing::QuickSensor(), now, pose);
      const LeveledScan scan = Reordered(cast, is_shuffled ? 7'919 : 1);
      EXPECT_TRUE(monitor.Observe(scan, pose, SureOfPlace(), i).ok());
    }
    monitor.Finish();
    return found;
  };
  const Contradictions found = watch(false);
  EXPECT_FALSE(found.empty());
  EXPECT_EQ(found, watch(true));
}

TEST(MapMonitorTest, WhatFallsBehindIsHandedOutOnTheWay) {
  const ShapeWorld mapped = Houses();
  ShapeWorld now = mapped;
  now.boxes.push_back(CarAt(3.0, 3.5));
  const PaintedMap map = MapOf(mapped);
  std::size_t found = 0;
  std::uint32_t scans = 0;
  MapMonitor monitor(map.profile(), map.Source(), {}, [&found](const Contradiction&) { ++found; });
  const auto drive_to = [&](double from_m, double to_m, double step_m) {
    for (double x = from_m; x < to_m; x += step_m) {
      const Pose pose = UprightPose({x, 0.0, kSensor_m}, 0.0);
      const LeveledScan scan = CastLeveledScan(testing::QuickSensor(), now, pose);
      EXPECT_TRUE(monitor.Observe(scan, pose, SureOfPlace(), scans++).ok());
    }
  };
  drive_to(-8.0, 8.0, 1.0);
  EXPECT_EQ(found, 0U);
  drive_to(8.0, 80.0, 8.0);
  EXPECT_GT(found, 40U);
  const std::size_t on_the_way = found;
  monitor.Finish();
  EXPECT_EQ(found, on_the_way);
}

TEST(MapMonitorTest, AnErrorOfTheSourceCountsNothing) {
  const PaintedMap map = MapOf(Houses());
  bool is_broken = true;
  const TilesAround tiles =
      [&](const Eigen::Vector3d& center,
          double radius_m) -> Result<std::vector<std::shared_ptr<const Tile>>> {
    if (is_broken) return Error(StatusCode::kUnavailable, "no link");
    return map.Source()(center, radius_m);
  };
  MapMonitor monitor(map.profile(), tiles, {}, [](const Contradiction&) {});
  const Pose pose = UprightPose({0.0, 0.0, kSensor_m}, 0.0);
  const LeveledScan scan = CastLeveledScan(testing::QuickSensor(), Houses(), pose);
  EXPECT_EQ(monitor.Observe(scan, pose, SureOfPlace(), 0).code(), StatusCode::kUnavailable);
  EXPECT_EQ(monitor.scans(), 0U);
  is_broken = false;
  EXPECT_TRUE(monitor.Observe(scan, pose, SureOfPlace(), 0).ok());
  EXPECT_EQ(monitor.scans(), 1U);
}

}  // namespace
}  // namespace atlas
