// What a localizer is told before it sees a scan, made from the truth: where about it starts, and
// which way is down.
#pragma once

#include <cstdint>

#include "core/geometry/pose.h"

namespace atlas {

// Names one draw: the same numbers on every machine.
struct TrialSeed {
  std::uint64_t seed = 0;
  std::uint32_t scan = 0;
  std::uint32_t trial = 0;
};

// The attitude as an IMU would give it: `tilt_error_rad` away from the truth, in a direction of the
// draw.
Eigen::Quaterniond DisturbedLevel(const Pose& T_world_sensor,
                                  double tilt_error_rad,
                                  const TrialSeed& seed);

// x and y uniform in +- translation_m, z in +- 0.2 m, yaw in +- yaw_rad; the tilt is
// R_level_sensor's.
Pose PerturbedStart(const Pose& T_world_sensor,
                    const Eigen::Quaterniond& R_level_sensor,
                    double translation_m,
                    double yaw_rad,
                    const TrialSeed& seed);

// Where the sensor is, off by up to `radius_m` in the plane and uniform in +- height_m.
Eigen::Vector3d PerturbedPosition(const Pose& T_world_sensor,
                                  double radius_m,
                                  double height_m,
                                  const TrialSeed& seed);

}  // namespace atlas
