// Version 2 kept where keyframes are and where they were in two tables, without since when.
#pragma once

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Inside of a transaction. A former footprint is taken to have been left with the keyframe's last
// correction: whoever asks what changed since is told of too much, not of too little.
void MigrateFromVersion2(Connection& connection);

}  // namespace atlas
