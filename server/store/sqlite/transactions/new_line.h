// An atlas that goes on from an earlier revision than it had.
#pragma once

#include <cstdint>

#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// Where an atlas stands, or stood.
struct PlaceInLine {
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;
};

// Another epoch, and revisions that were given to what is lost are given to nothing else. The start
// is noted before they are left out, so that what was kept elsewhere of them is not of this line.
// Nor are those given again up to `lost`, which may be of a later line than the database; 0: not
// known. Inside a transaction, which notes an event then. What it begins with.
PlaceInLine BeginLine(Connection& connection,
                      const StoreIdentity& identity,
                      const PlaceInLine& lost);

}  // namespace atlas
