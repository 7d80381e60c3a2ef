// Which sessions stay where they are: those in the map whose poses already say what their submaps
// do, among themselves and of each other, and those of whom nothing was learned. Whoever was merged
// before is not moved for the sake of a millimetre, and with him no tile.
#pragma once

#include <vector>

#include "client/merge/plan/closure_search.h"
#include "client/merge/plan/merge_options.h"
#include "client/merge/plan/merge_session.h"
#include "client/merge/plan/session_links.h"

namespace atlas {

// By session. None that is staged, none whose matched links are off, root mean square, by more than
// `held_m` or `held_rad`, but for one that meets nobody and has no positions; of those that are
// left the worst is let go until closures between them, too, are off by no more: of two that do not
// fit each other the first one stays. `links` by session; `closures` that are believed.
std::vector<bool> HeldSessions(const std::vector<MergeSession>& sessions,
                               const std::vector<std::vector<SessionLink>>& links,
                               const std::vector<FoundClosure>& closures,
                               const MergeOptions& options);

}  // namespace atlas
