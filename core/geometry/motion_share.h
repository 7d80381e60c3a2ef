// A part of a motion.
#pragma once

#include <Eigen/Geometry>

#include "core/geometry/pose.h"

namespace atlas {

// What of a motion has passed after such a share of its time, at an even pace; above 1: beyond it.
inline Pose ShareOf(const Pose& motion, double share) {
  const Eigen::AngleAxisd turn(motion.linear());
  Pose part = Pose::Identity();
  part.linear() = Eigen::AngleAxisd(share * turn.angle(), turn.axis()).toRotationMatrix();
  part.translation() = share * motion.translation();
  return part;
}

}  // namespace atlas
