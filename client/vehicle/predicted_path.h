// Where a vehicle will be if it goes on as it does: a route for AtlasView::Prefetch where no
// planner has a better one. Pure.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"

namespace atlas {

// Of a vehicle on the plane of the world frame.
struct PlanarMotion {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;     // counterclockwise from x
  double speed_m_s = 0.0;       // along the heading; below 0: backwards
  double yaw_rate_rad_s = 0.0;  // counterclockwise
};

// The arc of constant turn rate and velocity (CTRV; Schubert, Richter, Wanielik, "Comparison and
// evaluation of advanced motion models for vehicle tracking", FUSION 2008): points in metres in the
// world frame, the first where the vehicle is, the last where it is after `horizon_s`, or after one
// full turn, which says all. They are as far apart along the arc, at most `spacing_m`, unless that
// takes more than CorridorArea::kMaxRoutePoints; one of a vehicle that stands. 6.4 m is half of a
// tile of the default map: so the route leaves an arc of 6 m radius by less than 0.9 m.
// kInvalidArgument: what is not finite, a horizon below 0, a spacing that is not above 0.
Result<std::vector<Eigen::Vector2d>> PredictedPath(const PlanarMotion& motion,
                                                   double horizon_s,
                                                   double spacing_m = 6.4);

}  // namespace atlas
