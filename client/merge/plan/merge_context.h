// What all steps of a merge share.
#pragma once

#include "client/merge/memory/merge_work.h"
#include "client/merge/plan/merge_options.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// All outlive the merge; of other threads as well.
struct MergeContext {
  const MapProfile& profile;
  const MergeOptions& options;
  MergeWork& work;
};

}  // namespace atlas
