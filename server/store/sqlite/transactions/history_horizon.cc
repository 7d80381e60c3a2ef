#include "server/store/sqlite/transactions/history_horizon.h"

#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/start_table.h"

namespace atlas {

// As a compaction that dropped nothing: the horizon is that of the last one.
std::uint64_t MoveHorizon(Connection& connection, const std::string& author) {
  const std::uint64_t revision = NextRevision(connection);
  SetCounter(connection, Counter::kHistoryHorizon, revision);
  const std::int64_t id = TakeCompactionNumber(connection);
  WriteCompaction(connection, {id, revision, 0, author, 0, 0});
  return revision;
}

}  // namespace atlas
