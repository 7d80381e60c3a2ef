#include "server/store/sqlite/migrations/from_version_5.h"

namespace atlas {

void MigrateFromVersion5(Connection& connection) {
  connection.Execute("CREATE INDEX quarantined_sessions ON sessions (id) WHERE state = 2");
}

}  // namespace atlas
