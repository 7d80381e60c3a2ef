// Routes through the atlas: over curbs and ramps, under bridges, on any deck.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory_resource>
#include <optional>
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
  // A clock in seconds that does not go back, for options.max_time_s; empty: time has no limit.
  std::function<double()> now_s = {};
  // Where tiles and searches are kept, null: the heap. Nothing is given back before the end.
  std::pmr::memory_resource* memory = nullptr;
};

// Where an end of a route stands: on the surface, in the middle of a cell. World frame.
struct RouteEnd {
  Eigen::Vector3d asked = Eigen::Vector3d::Zero();  // the point that was given
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  std::size_t layer = 0;  // of the cell, 0 is the lowest
  std::size_t layers = 0;

  double aside_m() const { return (at - asked).head<2>().norm(); }
  double above_m() const { return at.z() - asked.z(); }  // negative: below the point
  // To another cell, or up or down by more than half a cell's side.
  bool IsMoved(double cell_m) const {
    return (at - asked).cwiseAbs().maxCoeff() > 0.5 * cell_m + 1e-9;
  }
};

struct Route {
  bool found = false;
  // Known whether a route is found or not; none where something is traversable near the point, but
  // nowhere this vehicle may stand.
  std::optional<RouteEnd> start;
  std::optional<RouteEnd> goal;
  double length_m = 0.0;                   // along the waypoints
  double cost = 0.0;                       // metres, weighted by how close obstacles are
  double searched_cost = 0.0;              // before the way was straightened: no less
  std::vector<Eigen::Vector3d> waypoints;  // on the surface, no step higher than max_step_m
  // Of each waypoint, metres to the nearest obstacle on its surface, at most
  // PlanOptions::clearance_reach_m(), and how steep the surface is, in any direction.
  std::vector<double> clearance_m;
  std::vector<double> slope_deg;
  std::size_t tiles_loaded = 0;      // of the finest level
  std::uint64_t expansions = 0;      // of all levels
  std::size_t max_memory_bytes = 0;  // what the limit was compared with, at most
};

// The cheapest route for the vehicle that the options describe, to within 2 % of what a search over
// everything finds (as measured, docs/results.md), over tiles loaded as needed: level 0, and two
// coarser levels for a corridor (docs/algorithms/planning.md). found = false when the surfaces that
// start and goal stand on are not joined for this vehicle. kNotFound: no traversable surface near
// start or goal; kInvalidArgument: options out of range, or a point outside the world;
// kResourceExhausted: the limit of expansions or memory; kTimeout: that of time; tiles' errors.
Result<Route> PlanRoute(TileSource& tiles, const MapProfile& profile, const PlanRequest& request);

}  // namespace atlas
