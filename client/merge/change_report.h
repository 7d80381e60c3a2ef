// What the sessions that a merge publishes saw otherwise than those before them, as a list and as a
// picture.
#pragma once

#include <optional>
#include <vector>

#include "client/merge/changes/map_change.h"
#include "client/merge/merge_run.h"
#include "client/render/image.h"
#include "core/base/status.h"

namespace atlas {

struct ChangeReport {
  std::vector<MapChange> changes;  // by session as the run has them
  std::optional<Image> picture;    // none where no session is published
};

// Where the merge has everything; `progress` may be empty. Errors are those of ChangesSeenBy.
Result<ChangeReport> ReportChanges(const MergeRun& run, const MergeProgress& progress);

}  // namespace atlas
