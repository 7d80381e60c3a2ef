// The last metres that a vehicle drove before a scan: between two keyframes it was somewhere, too.
#pragma once

#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/geometry/vehicle_body.h"
#include "core/keyframe/sensor_mount.h"

namespace atlas {

// Places a metre apart along the last 5 m of `T_world_sensor`, the drive until the scan, its
// own pose last; the latest place first. Two poses more than 5 m apart end it: a jump.
std::vector<VehiclePlace> TrailBefore(std::span<const Pose> T_world_sensor,
                                      const SensorMount& mount);

}  // namespace atlas
