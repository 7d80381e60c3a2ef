// A thing of the simulation as the box around it: what was parked, what moved and where.
#pragma once

#include <cstdint>

#include <Eigen/Geometry>

#include "core/geometry/pose.h"

namespace atlas {

struct TruthBox {
  Pose T_world_box = Pose::Identity();               // x forward, origin in the box's middle
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  // along its x, y, z
  std::uint32_t label = 0;                           // truth_label.h

  // Grown by `margin_m` on every side.
  bool Contains(const Eigen::Vector3d& p_world, double margin_m = 0.0) const {
    const Eigen::Vector3d p = T_world_box.inverse() * p_world;
    return (p.cwiseAbs().array() <= 0.5 * size_m.array() + margin_m).all();
  }
};

}  // namespace atlas
