// What a merge found, as JSON: the contract of `atlas-merge run --json` and of reports.
#pragma once

#include <optional>

#include <boost/json/object.hpp>

#include "client/merge/merge_run.h"

namespace atlas {

// Without a batch nothing was applied.
boost::json::object MergeJson(const MergeRun& run, const std::optional<PoseBatchSummary>& batch);

}  // namespace atlas
