// Version 3 got compactions, and some of its atlases a list of starts, without another number.
#pragma once

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Inside of a transaction. Adds what the atlas lacks of both.
void MigrateFromVersion3(Connection& connection);

}  // namespace atlas
