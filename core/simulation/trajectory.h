// A recorded list of sensor poses as something to drive: thinned, timed, cut at jumps.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/pose.h"
#include "core/simulation/traffic.h"

namespace atlas {

struct TrajectoryOptions {
  double every_m = 0.0;     // least distance between scans; 0 keeps every pose
  double interval_s = 0.1;  // between poses; KITTI's
  double jump_m = 10.0;     // a longer step begins a new leg
};

struct Trajectory {
  std::vector<DriveMoment> moments;  // one a scan
  // The sensor's way, a leg each: points 1 m or more apart. Independent of every_m.
  std::vector<std::vector<Eigen::Vector3d>> legs;
};

// The legs as a vehicle drives them whose sensor stands so high above the ground.
std::vector<DrivePath> GroundBelow(const Trajectory& trajectory, double sensor_height_m);

// kInvalidArgument on options out of range; kInvalidData without a pose.
Result<Trajectory> PlanTrajectory(std::span<const Pose> poses, const TrajectoryOptions& options);

}  // namespace atlas
