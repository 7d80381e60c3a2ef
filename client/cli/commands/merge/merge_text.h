// What a merge found, as text and as JSON.
#pragma once

#include <ostream>

#include <boost/json/object.hpp>

#include "client/merge/merge_run.h"

namespace atlas {

void PrintMerge(const MergeRun& run, std::ostream& out);
boost::json::object MergeJson(const MergeRun& run);

}  // namespace atlas
