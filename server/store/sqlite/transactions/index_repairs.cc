#include "server/store/sqlite/transactions/index_repairs.h"

#include <functional>
#include <vector>

#include "server/store/event_types.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/table_order.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/keyframe_row.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/tile_table.h"
#include "server/store/sqlite/transactions/key_repairs.h"
#include "server/store/sqlite/transactions/transactions.h"

namespace atlas {
namespace {

// An index that was made anew of damaged rows says no more what they were.
Status CheckRowsAreWhole(Connection& connection) {
  std::vector<std::function<Status(Connection&)>> checks;
  AddOrderChecks([] { return Status(); }, checks);
  checks.emplace_back(&CheckKeyedRows);
  for (const auto& check : checks) {
    ATLAS_RETURN_IF_ERROR(check(connection));
  }
  if (!ListDamagedSessions(connection).empty()) {
    return {StatusCode::kInvalidData, "store: rows of table sessions are damaged"};
  }
  Query twins = connection.Prepare(
      "SELECT 1 FROM sessions NOT INDEXED GROUP BY vehicle, session HAVING count(*) > 1");
  return twins.Step() ? Status(StatusCode::kInvalidData, "store: two sessions have one name")
                      : Status();
}

}  // namespace

Result<std::uint32_t> RepairIndexes(Connection& connection,
                                    std::uint8_t levels,
                                    const std::string& author) {
  // All that a whole row of footprints was made of may be in one of two places.
  const bool is_ordered =
      PutTablesInOrder(connection, OrderedTables::kFootprints, &TellKeyframeNumbers).empty();
  Status status = is_ordered ? Status() : CheckTableSum(connection, RowKind::kFootprint);
  if (status.ok()) {
    status = CheckRowsAreWhole(connection);
  }
  if (!status.ok()) {
    return Error(std::move(status));
  }
  std::uint32_t repaired = 1;
  RestoreIndexes(connection);
  repaired += PutBackLostTiles(connection);
  {
    const ToleratedIndexes tolerated(connection);
    repaired += RestoreTileRows(connection);
  }
  repaired += RepairKeys(connection, author);
  connection.Execute("REINDEX tombstones; REINDEX sessions");
  AddEvent(connection, {EventKind::kTablesRepaired, author, "indexes",
                        "they had something else than their tables and were made anew"});
  MarkAllInStore(connection, "indexes were damaged", levels);
  return repaired;
}

}  // namespace atlas
