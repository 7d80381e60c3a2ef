// The flags of `atlas plan` that say what the vehicle is and what a plan may cost.
#pragma once

#include "client/cli/command_line/argument_set.h"
#include "core/planning/plan_options.h"

namespace atlas {

// The targets outlive the set. `memory_mib` is what PlanOptions counts in bytes.
void DeclarePlanFlags(ArgumentSet& arguments, PlanOptions& options, std::uint32_t& memory_mib);

}  // namespace atlas
