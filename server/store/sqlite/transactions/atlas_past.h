// What of an atlas's past its answers depend upon. The rows of events tell it, and may be damaged:
// what else tells it is asked, too (docs/decisions/0509-a-damaged-past.md).
#pragma once

#include <vector>

#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

struct AtlasPast {
  // In order. Of a line whose beginning is damaged or gone: all between the last revision that is
  // known to be of the one before and the first one that is known to be of it.
  std::vector<LostRevisions> lost;
  bool may_have_purged = false;  // also where nobody can tell
};

AtlasPast ReadPast(Connection& connection);

}  // namespace atlas
