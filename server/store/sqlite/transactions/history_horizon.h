// The oldest revision that can be read, as what happens inside a savepoint.
#pragma once

#include <cstdint>
#include <string>

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Nothing of before can be read as it was from now on, and what was kept of tiles is made anew. The
// revision from which on it can.
std::uint64_t MoveHorizon(Connection& connection, const std::string& author);

}  // namespace atlas
