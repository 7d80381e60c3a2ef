// Rows that stand under another key than they were written with, or two under one: an index that
// allows a key once cannot be made anew of them. As what happens inside a savepoint.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Of keyframes, lines of poses and lines of states: a damaged row gets back the key that its index
// still has, where its checksum agrees; of two under one key the damaged or the younger one goes.
// Then their indexes, and those without such keys, are made anew, but for those of sessions. How
// many rows were not as they should be.
std::uint32_t RepairKeys(Connection& connection, const std::string& author);

// Whether it could do more than make indexes anew and drop what was stored twice: damaged rows, or
// two different ones under a key, are for somebody to decide. kInvalidData names them.
Status CheckKeyedRows(Connection& connection);

}  // namespace atlas
