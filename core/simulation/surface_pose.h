// The pose of a sensor on a vehicle that stands on a surface.
#pragma once

#include "core/base/status.h"
#include "core/geometry/pose.h"
#include "core/simulation/drive_path.h"
#include "core/simulation/mesh/static_world.h"

namespace atlas {

// The point of the surface straight below or above `p_world`, looked for from 1.2 m above it to
// 1.2 m below. kInternal when there is none.
Result<Eigen::Vector3d> SurfaceNear(const WorldParts& still, const Eigen::Vector3d& p_world);

// T_world_sensor, `height_m` straight above the surface, tilted as the four wheels of a small car
// stand. kInternal when one of them finds no surface.
Result<Pose> PoseOnSurface(const WorldParts& still, const PathPoint& at, double height_m);

}  // namespace atlas
