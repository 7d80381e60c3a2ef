// What a merge found, as text and as JSON.
#pragma once

#include <optional>
#include <ostream>

#include <boost/json/object.hpp>

#include "client/merge/merge_run.h"

namespace atlas {

void PrintMerge(const MergeRun& run, std::ostream& out);
// Without a batch nothing was applied.
boost::json::object MergeJson(const MergeRun& run, const std::optional<PoseBatchSummary>& batch);

}  // namespace atlas
