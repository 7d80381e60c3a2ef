// When the atlas was opened to be changed (AtlasStart), and the revisions that it takes.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// The number of a change about to be committed. The first of a connection notes its start, and
// forgets all starts but the last hundred.
std::uint64_t NextRevision(Connection& connection);

// Oldest first, those before a damaged one left out.
std::vector<AtlasStart> ReadStarts(Connection& connection);
// kInvalidData when a row is damaged.
Status CheckStarts(Connection& connection);
// Damaged ones and all before them, of which nothing is known. How many.
int DropUnknownStarts(Connection& connection);

}  // namespace atlas
