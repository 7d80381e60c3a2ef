// What a merge found, for people.
#pragma once

#include <ostream>

#include "client/merge/merge_run.h"

namespace atlas {

// Each session and what becomes of it, each two that were found in each other, and how much of the
// map is fused again.
void PrintMerge(const MergeRun& run, std::ostream& out);

}  // namespace atlas
