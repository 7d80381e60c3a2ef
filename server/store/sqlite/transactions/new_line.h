// An atlas that goes on from an earlier revision than it had.
#pragma once

#include <cstdint>

#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

struct NewLine {
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;
};

// Another epoch, and revisions that were given to what is lost are given to nothing else. The start
// is noted before they are left out, so that what was kept elsewhere of them is not of this line.
// Inside a transaction, which notes an event then.
NewLine BeginLine(Connection& connection, const StoreIdentity& identity);

}  // namespace atlas
