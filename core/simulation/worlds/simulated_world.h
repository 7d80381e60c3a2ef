// The procedural worlds: what stands, what moves, and where one drives. A world never depends on
// the drive's seed, so that one drive can be localized in the map of another.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "core/base/status.h"
#include "core/simulation/drive_path.h"
#include "core/simulation/mesh/triangle_mesh.h"

namespace atlas {

enum class WorldKind { kStreet, kOverpass, kGarage };

// "street", "overpass", "garage"; kInvalidArgument for another name.
Result<WorldKind> WorldKindByName(std::string_view name);

// Moves along a leg, in its direction or against it, from the moment the leg begins.
struct TrafficParticipant {
  TriangleMesh mesh;  // x forward, origin on the ground
  std::size_t leg = 0;
  bool is_oncoming = false;
  double start_m = 0.0;  // along its own direction
  double speed_m_s = 5.0;
  double left_m = 0.0;  // in its own direction
  // Drives where the vehicle does, `start_m` ahead of it, instead of at a speed of its own.
  bool is_leading = false;
};

// Where a car may be parked in one drive and not in another (DriveOptions::parked_seed).
struct ParkedSlot {
  Eigen::Isometry3d T_world_car = Eigen::Isometry3d::Identity();  // x forward, on the ground
  std::uint32_t deck = 0;
};

struct SimulatedWorld {
  TriangleMesh mesh;
  std::vector<DrivePath> legs;  // driven one after the other
  std::vector<TrafficParticipant> traffic;
  std::vector<ParkedSlot> parked_slots;
  double lane_left_m = 0.0;  // of the drive, from the middle of a leg, in its direction
};

// 240 m of street with a curve: 12 cm curbs, sidewalks, houses, fences, trees, poles, parked cars
// and slots for more; a car ahead, two that come towards, and a walker.
SimulatedWorld MakeStreetWorld();

// A road along x and a bridge over it along y, 5.5 m above: piers, a slab of 0.6 m, guard rails.
// Legs: the road, then the bridge.
SimulatedWorld MakeOverpassWorld();

struct GarageOptions {
  std::size_t decks = 4;       // 2 to 20
  double deck_height_m = 3.2;  // 2.6 to 3.5: the steepest part of a ramp is height / 19.5 m
};
// Decks of 52 m x 28 m joined by straight ramps in the middle, pillars, parked cars. One leg: in
// from the street, once around each deck, up to the roof. kInvalidArgument on options out of range.
Result<SimulatedWorld> MakeGarageWorld(const GarageOptions& options);

Result<SimulatedWorld> MakeWorld(WorldKind kind);

}  // namespace atlas
