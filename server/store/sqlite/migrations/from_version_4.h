// Version 4 had tables without checksums, and nothing that tells of rows that are gone.
#pragma once

#include <string>

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Inside of a transaction. Also adds the counters that earlier versions lack. Numbers that rows
// tell, too, are counted again; which of them were others, and that sessions are lost, is returned,
// for people: "; it counted ...", empty if all is well.
std::string MigrateFromVersion4(Connection& connection);

}  // namespace atlas
