// Ranges of the planner's options.
#include "core/planning/plan_options.h"

#include "core/base/str_cat.h"

namespace atlas {
namespace {

struct Range {
  const char* name;
  double value;
  double low;
  double high;
};

}  // namespace

Status PlanOptions::Validate(const MapProfile& profile) const {
  const double side_m = profile.tile_size_m();
  const Range ranges[] = {
      {"max slope in degrees", max_slope_deg, 0.1, 60.0},
      {"max step in metres", max_step_m, 0.0, 1.0},
      {"vehicle width in metres", vehicle_width_m, 0.0, 10.0},
      {"safety margin in metres", safety_margin_m, 0.0, 5.0},
      {"headroom in metres", headroom_m, 0.0, 20.0},
      {"slab thickness in metres", slab_thickness_m, 0.0, 5.0},
      // Cells are looked at in a tile and its eight neighbours.
      {"slope radius in metres", slope_radius_m, profile.cell_size_m(), side_m},
      {"min support", min_support, 0.0, 1.0},
      {"max gap in metres", max_gap_m, 0.0, 1.0},
      {"occupied probability", occupied_probability, 0.5, 1.0},
      {"comfort distance in metres", comfort_m, 0.0, 10.0},
      {"inflation and comfort in metres", clearance_reach_m(), 0.0, side_m},
      {"comfort weight", comfort_weight, 0.0, 100.0},
      {"snap radius in metres", snap_radius_m, 0.0, 50.0},
      {"snap below in metres", snap_below_m, 0.0, 50.0},
      {"snap far below in metres", snap_far_below_m, 0.0, 50.0},
      {"snap above in metres", snap_above_m, 0.0, 50.0},
      {"waypoint spacing in metres", waypoint_spacing_m, 0.0, 1000.0},
      {"time limit in seconds", max_time_s, 1e-3, 1e6},
      {"limit of expansions", static_cast<double>(max_expansions), 1.0, 1e18},
      {"memory limit in MiB", static_cast<double>(max_memory_bytes) / (1 << 20), 1e-3, 1e9},
  };
  for (const Range& range : ranges) {
    if (!(range.value >= range.low && range.value <= range.high)) {  // NaN fails too
      return Status(StatusCode::kInvalidArgument,
                    StrCat("plan: ", range.name, " is ", range.value, ", expected ", range.low,
                           " to ", range.high));
    }
  }
  return profile.Validate();
}

}  // namespace atlas
