// Two keyframes of one key: an index that had lost the first one let it be stored again. As what
// happens inside a savepoint.
#pragma once

#include <cstdint>
#include <string>

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

struct KeyframeTwins {
  std::int64_t older = 0;
  std::int64_t younger = 0;
  std::int64_t session_id = 0;  // of the one that stays
};

// What came first stays, with the corrections that the other one got meanwhile, and with its bytes
// where its own are damaged: as if it had been sent once. A damaged row that has the key of another
// keyframe goes itself. Marks what either touched; the horizon is to be moved behind it. The id of
// the one that stays.
std::int64_t SettleTwins(Connection& connection,
                         const KeyframeTwins& twins,
                         const std::string& author);

}  // namespace atlas
