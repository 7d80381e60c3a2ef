// Whether a goal is shut in: nothing leads to it but a few cells around it. Tells at once that
// there is no route where a search from the start would go over all of the map.
#pragma once

#include "core/base/status.h"
#include "core/planning/plan_budget.h"
#include "core/planning/surface/surface_map.h"

namespace atlas {

// True when no way leads from `start` to `goal`; false: it may. Looks at so many nodes only. Errors
// as of PlanBudget and of the tile source.
Result<bool> IsEnclosed(SurfaceMap& map,
                        const NodeRef& goal,
                        const NodeRef& start,
                        PlanBudget& budget);

}  // namespace atlas
