// Two roads that cross without meeting.
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/hash_random.h"
#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/props.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas {
namespace {

constexpr double kWorld_m = 140.0;  // half its side
constexpr double kDrive_m = 150.0;  // length of each leg
constexpr double kRoadEdge_m = 6.0;
constexpr double kBridgeEdge_m = 5.0;
constexpr double kDeck_m = 5.5;
constexpr double kSlab_m = 0.6;
constexpr double kRail_m = 0.9;
constexpr double kLane_m = -3.0;

constexpr std::uint32_t kPierLabel = TruthLabel(TruthClass::kOtherStructure);

void AddGround(MeshBuilder& out) {
  out.Floor({{-kWorld_m, -kRoadEdge_m, 0.0}, {kWorld_m, kRoadEdge_m, 0.0}},
            TruthLabel(TruthClass::kRoad));
  for (const double side : {-1.0, 1.0}) {
    const double edge_m = side * kRoadEdge_m;
    const double end_m = side * kWorld_m;
    out.Floor({{-kWorld_m, std::min(edge_m, end_m), 0.0}, {kWorld_m, std::max(edge_m, end_m), 0.0}},
              TruthLabel(TruthClass::kTerrain));
  }
}

void AddBridge(MeshBuilder& out) {
  constexpr std::uint32_t kRoad = TruthLabel(TruthClass::kRoad, 1);
  constexpr std::uint32_t kRail = TruthLabel(TruthClass::kFence, 1);
  constexpr std::uint32_t kSlab = TruthLabel(TruthClass::kOtherStructure, 1);
  constexpr double kOuter_m = kBridgeEdge_m + 0.3;
  constexpr std::array<ProfileCorner, 9> profile = {{
      {kOuter_m, -kSlab_m, kSlab},
      {kOuter_m, kRail_m, kRail},
      {kBridgeEdge_m, kRail_m, kRail},
      {kBridgeEdge_m, 0.0, kRoad},
      {-kBridgeEdge_m, 0.0, kRail},
      {-kBridgeEdge_m, kRail_m, kRail},
      {-kOuter_m, kRail_m, kSlab},
      {-kOuter_m, -kSlab_m, kSlab},
      {kOuter_m, -kSlab_m, 0},
  }};
  DrivePath bridge({{0.0, -kWorld_m, kDeck_m}, std::numbers::pi / 2.0});
  out.Extrude(bridge.Straight(2.0 * kWorld_m), profile);
  for (const double y : {-105.0, -73.0, -41.0, -25.0, -9.0, 9.0, 25.0, 41.0, 73.0, 105.0}) {
    for (const double x : {-3.5, 3.5}) {
      out.Box({{x - 0.6, y - 0.6, 0.0}, {x + 0.6, y + 0.6, kDeck_m - kSlab_m}}, kPierLabel);
    }
    out.Box({{-kOuter_m, y - 0.7, kDeck_m - kSlab_m - 0.5}, {kOuter_m, y + 0.7, kDeck_m - kSlab_m}},
            kPierLabel);
  }
}

void AddPoles(MeshBuilder& out) {
  for (int i = -5; i <= 5; ++i) {
    const double along_m = 24.0 * i + 7.0;
    const double side = i % 2 == 0 ? 1.0 : -1.0;
    AddPole({along_m, side * (kRoadEdge_m + 0.8), 0.0}, 8.0, 0, out);
    AddPole({side * (kBridgeEdge_m + 0.15), along_m + 5.0, kDeck_m}, 7.0, 1, out);
  }
}

// Houses and trees in the four quarters between the roads.
void AddSurroundings(MeshBuilder& out) {
  HashRandom random(0x0E295A55);
  for (const double x_side : {-1.0, 1.0}) {
    for (const double y_side : {-1.0, 1.0}) {
      for (int i = 0; i < 14; ++i) {
        const double x = x_side * random.Uniform(22.0, 130.0);
        const double y = y_side * random.Uniform(20.0, i % 2 == 0 ? 45.0 : 130.0);
        const Eigen::Isometry3d frame = FrameAt({{x, y, 0.0}, random.Uniform(0.0, 6.28)});
        AddHouse(frame,
                 {random.Uniform(8.0, 16.0), random.Uniform(7.0, 10.0), random.Uniform(5.0, 14.0)},
                 out);
      }
      for (int i = 0; i < 16; ++i) {
        AddTree({x_side * random.Uniform(9.0, 120.0), y_side * random.Uniform(9.0, 18.0), 0.0},
                random.Uniform(1.3, 2.6), out);
      }
    }
  }
}

}  // namespace

SimulatedWorld MakeOverpassWorld() {
  SimulatedWorld world;
  MeshBuilder builder;
  AddGround(builder);
  AddBridge(builder);
  AddPoles(builder);
  AddSurroundings(builder);
  world.mesh = builder.Take();
  DrivePath road({{-kDrive_m / 2.0, 0.0, 0.0}, 0.0});
  DrivePath bridge({{0.0, -kDrive_m / 2.0, kDeck_m}, std::numbers::pi / 2.0});
  world.legs = {road.Straight(kDrive_m), bridge.Straight(kDrive_m)};
  world.lane_left_m = kLane_m;
  const TriangleMesh car = CarMesh(TruthLabel(TruthClass::kMovingCar));
  const TriangleMesh bridge_car = CarMesh(TruthLabel(TruthClass::kMovingCar, 1));
  world.traffic = {{car, 0, true, 0.0, 7.0, kLane_m},
                   {car, 0, false, 20.0, 5.2, kLane_m},
                   {bridge_car, 1, true, 10.0, 6.0, kLane_m}};
  return world;
}

}  // namespace atlas
