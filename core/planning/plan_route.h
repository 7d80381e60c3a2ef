// Routes through the atlas: over curbs and ramps, under bridges, on any deck.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/planning/plan_options.h"
#include "core/planning/tile_source.h"

namespace atlas {

struct PlanRequest {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();  // world frame
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  PlanOptions options;
};

struct Route {
  bool found = false;
  double length_m = 0.0;                   // along the waypoints
  double cost = 0.0;                       // metres, weighted by how close obstacles are
  std::vector<Eigen::Vector3d> waypoints;  // on the surface, no step higher than max_step_m
  std::size_t tiles_loaded = 0;
  std::uint64_t expansions = 0;
};

// The cheapest route for the vehicle that the options describe, over level-0 tiles loaded as
// needed; found = false when the surfaces that start and goal stand on are not joined for this
// vehicle. kNotFound: no traversable surface near start or goal; kInvalidArgument: options out of
// range, or a point outside the world; kResourceExhausted: the limit of expansions or memory;
// tiles' errors.
Result<Route> PlanRoute(TileSource& tiles, const MapProfile& profile, const PlanRequest& request);

}  // namespace atlas
