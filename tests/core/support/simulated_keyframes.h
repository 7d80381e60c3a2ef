// A piece of a simulated drive as a vehicle's front end makes it: keyframes in memory, where they
// truly are, and where the vehicle thinks that they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"
#include "core/keyframe/keyframe.h"
#include "core/simulation/pose_drift.h"
#include "core/simulation/truth_box.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas::testing {

struct DrivePiece {
  WorldKind world = WorldKind::kStreet;
  std::uint64_t seed = 0;  // DriveOptions::seed: odd ones go the other way
  std::size_t first = 0;   // scan, 1.25 m apart
  std::size_t count = 1;
  std::optional<DriftOptions> drift = std::nullopt;  // none: true poses
  std::uint64_t parked_seed = 0;                     // DriveOptions::parked_seed
};

// As many of each.
struct DrivenKeyframes {
  std::vector<Pose> truth;           // T_world_sensor
  std::vector<Pose> T_world_sensor;  // with drift: right at the first one
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  std::vector<TruthBox> parked;  // cars that are parked in this drive, all along the way
};

// Throws where the simulation fails.
DrivenKeyframes DriveThrough(const DrivePiece& piece, const MapProfile& profile);

}  // namespace atlas::testing
