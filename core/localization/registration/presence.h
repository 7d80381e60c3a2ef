// How well a scan's returns lie in occupied segments: the sum over all returns of the logarithm of
// how much of each, uncertain as its place is, lies in them, or is an outlier. Unlike lines through
// cells it has no ties between neighbours, and ends at the same place from wherever it began.
#pragma once

#include <span>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/registration/normal_equations.h"
#include "core/localization/window/map_window.h"

namespace atlas {

struct PresenceSum {
  double log_likelihood = 0.0;  // up to a constant
  double present = 0.0;         // how many returns lie in occupied segments
  // Of its change with the pose (Newton: the curvature of each return, where it is one of a
  // maximum).
  NormalEquations equations;
};

// `returns`: levelled frame, metres, from obstacles.
PresenceSum SumPresence(const MapWindow& map,
                        std::span<const Eigen::Vector3f> returns,
                        const Pose& T_world_level);

}  // namespace atlas
