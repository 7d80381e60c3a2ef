// What a vehicle can drive over and under, and what planning may cost.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

struct PlanOptions {
  // Limits of the vehicle.
  double max_slope_deg = 25.0;   // of the surface in any direction
  double max_step_m = 0.195;     // between neighbouring cells: 0.2 less what rounding adds
  double vehicle_width_m = 1.8;  // a small car; half of it and the margin inflate obstacles
  double safety_margin_m = 0.1;
  double headroom_m = 2.0;        // free height above the surface
  double slab_thickness_m = 0.3;  // a surface above has an underside at least this much lower

  // Slope is that of a plane fitted to the surface within this radius: over single cells, noise of
  // 3 cm would read as 17 degrees; over 1 m it reads as 1.4 (one sigma).
  double slope_radius_m = 0.5;
  // Where fewer of the cells within that radius are known, the surface is taken to end.
  double min_support = 0.4;
  // Unknown cells are not traversable, but a hole in a sparse map no longer than this is crossed.
  double max_gap_m = 0.2;
  // Drives over what was seen but never found free, too. Where nothing was seen there is no
  // surface to drive on: holes are crossed up to max_gap_m.
  bool allow_unknown = false;
  // Column segments and cells count as occupied from here on (a single return is 0.73): where hits
  // and misses balance, a cell is not driven over but does not close what lies around it.
  double occupied_probability = 0.6;

  // Driving closer than this to an inflated obstacle costs up to 1 + comfort_weight times as much.
  double comfort_m = 0.5;
  double comfort_weight = 1.0;

  // Start and goal stand on the highest surface between `snap_below_m` below the given point (which
  // may be a sensor's) and `snap_above_m` above it, and are moved at most this far across. Only
  // where none is there they may stand farther below, under a lorry's sensor: not on another deck.
  double snap_radius_m = 3.0;
  double snap_below_m = 2.5;
  double snap_far_below_m = 4.5;
  double snap_above_m = 0.5;

  // Points of the found route are thinned out to this distance.
  double waypoint_spacing_m = 0.5;

  // Searches the finest level alone, over everything: what a corridor is compared with.
  bool is_exhaustive = false;

  // Limits of the planner.
  std::uint64_t max_expansions = 20'000'000;
  std::size_t max_memory_bytes = std::size_t{512} << 20;
  double max_time_s = 60.0;  // by the clock that is passed in

  double inflation_m() const { return 0.5 * vehicle_width_m + safety_margin_m; }
  double clearance_reach_m() const { return inflation_m() + comfort_m; }

  // kInvalidArgument naming the first option out of its range.
  Status Validate(const MapProfile& profile) const;
};

}  // namespace atlas
