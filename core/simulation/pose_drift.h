// Poses as an odometry would have them that knows the vertical: right at the start, and off more
// and more along the way.
#pragma once

#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/pose.h"

namespace atlas {

struct DriftOptions {
  double position = 0.01;  // of the way driven, in each of the vehicle's axes
  double yaw_rad_a_m = 0.5 * std::numbers::pi / 180.0 / 100.0;
  double tilt_rad = 0.5 * std::numbers::pi / 180.0;  // roll and pitch wander within that
  // Most of an error keeps its sign along the drive; the rest wanders with the way.
  double steady = 0.7;
  double wavelength_m = 200.0;
  std::uint64_t seed = 1;  // of the same seed the same drift

  // kInvalidArgument naming the first option out of range.
  Status Validate() const;
};

// Of poses along a way, T_world_sensor, as many. A step of more than `jump_m` is taken as it is:
// another part of a drive begins there.
std::vector<Pose> Drifted(std::span<const Pose> T_world_sensor,
                          const DriftOptions& options,
                          double jump_m = 10.0);

}  // namespace atlas
