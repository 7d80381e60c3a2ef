// Rows about what compactions dropped and about starts of the daemon that are damaged or gone, as
// what happens inside a savepoint.
#pragma once

#include <cstdint>
#include <string>

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// A damaged tombstone goes: what it stood for is stored anew if it is sent again. A compaction is
// told by its checksum, what is left of it and those around it, and has dropped what tombstones are
// there. How many were repaired.
std::uint32_t RepairCompactions(Connection& connection, const std::string& author);

// Of a damaged start and those before it nothing is known: they go. How many.
std::uint32_t RepairStarts(Connection& connection, const std::string& author);

}  // namespace atlas
