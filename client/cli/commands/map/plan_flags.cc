// Defaults in the help are those of PlanOptions.
#include "client/cli/commands/map/plan_flags.h"

namespace atlas {

void DeclarePlanFlags(ArgumentSet& arguments, PlanOptions& options, std::uint32_t& memory_mib) {
  arguments.Optional("--max-slope-deg", "D", options.max_slope_deg,
                     "Steepest surface the vehicle drives [25]");
  arguments.Optional("--max-step", "M", options.max_step_m,
                     "Highest step between neighbouring cells [0.195]");
  arguments.Optional("--width", "M", options.vehicle_width_m, "Of the vehicle [1.8]");
  arguments.Optional("--margin", "M", options.safety_margin_m,
                     "To obstacles, to each side, in any case [0.1]");
  arguments.Optional("--headroom", "M", options.headroom_m, "Free height that it needs [2]");
  arguments.Optional("--max-gap", "M", options.max_gap_m,
                     "Longest hole in the map that is driven over [0.2]");
  arguments.Optional(
      "--comfort", "M", options.comfort_m,
      "Closer than this beyond the margin costs more; clearance is measured up to there [0.5]");
  arguments.Optional("--comfort-weight", "W", options.comfort_weight,
                     "Beside an obstacle a metre costs 1 + W [1]");
  arguments.Flag("--allow-unknown", options.allow_unknown,
                 "Also over what was seen but never found free");
  arguments.Optional("--max-expansions", "N", options.max_expansions,
                     "Nodes looked around at most [20000000]");
  arguments.Optional("--max-time", "S", options.max_time_s, "Seconds that it may take [60]");
  arguments.Optional("--max-memory", "MIB", memory_mib, "For tiles and search [512]");
  arguments.Flag("--exhaustive", options.is_exhaustive,
                 "Over everything, without a corridor, to compare with");
}

}  // namespace atlas
