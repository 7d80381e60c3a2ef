#include "server/store/sqlite/transactions/counter_check.h"

#include <optional>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/schema_check.h"
#include "server/store/sqlite/schema/table_order.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/damaged_keyframe_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/pose_batch_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/start_table.h"

namespace atlas {
namespace {

enum class Told { kExactly, kAtLeast };

struct Recount {
  Counter counter;
  const char* name;  // column name of table counters
  Told told;         // by the rows
  const char* sql;
};

// The number of sessions gives them their ids: it is the highest. Cells are those of level 0, whose
// keys begin with 0 (tile_id.h). Sums leave out what no blob and no tile has: damaged rows must not
// overflow them.
constexpr Recount kRecounts[] = {
    {Counter::kRevision, "revision", Told::kAtLeast,
     "SELECT max(coalesce((SELECT max(revision) FROM pose_history), 0), "
     "coalesce((SELECT max(revision) FROM tiles), 0), "
     "coalesce((SELECT max(generation) FROM dirty_tiles), 0), "
     "coalesce((SELECT max(revision) FROM session_states), 0), "
     "coalesce((SELECT max(revision) FROM events), 0), "
     "coalesce((SELECT max(revision) FROM starts), 0))"},
    {Counter::kBatch, "batch", Told::kAtLeast, "SELECT coalesce(max(id), 0) FROM pose_batches"},
    {Counter::kLastKeyframeId, "last_keyframe_id", Told::kAtLeast,
     "SELECT coalesce(max(id), 0) FROM keyframes"},
    {Counter::kKeyframes, "keyframes", Told::kExactly, "SELECT count(*) FROM keyframes"},
    {Counter::kKeyframeBytes, "keyframe_bytes", Told::kExactly,
     "SELECT coalesce(sum(blob_bytes & 0xFFFFFFFF), 0) FROM keyframes"},
    {Counter::kTiles, "tiles", Told::kExactly, "SELECT count(*) FROM tiles"},
    {Counter::kTileBytes, "tile_bytes", Told::kExactly,
     "SELECT coalesce(sum(blob_bytes & 0xFFFFFFFF), 0) FROM tiles"},
    {Counter::kCells, "cells", Told::kExactly,
     "SELECT coalesce(sum(cells & 0xFFFFFFFF), 0) FROM tiles WHERE key BETWEEN 0 AND (1 << 58) - "
     "1"},
    {Counter::kMultilayerCells, "multilayer_cells", Told::kExactly,
     "SELECT coalesce(sum(multilayer_cells & 0xFFFFFFFF), 0) FROM tiles "
     "WHERE key BETWEEN 0 AND (1 << 58) - 1"},
    {Counter::kSessions, "sessions", Told::kExactly, "SELECT coalesce(max(id), 0) FROM sessions"},
    {Counter::kHistoryHorizon, "history_horizon", Told::kExactly,
     "SELECT coalesce(max(revision), 0) FROM compactions"},
    {Counter::kCompactions, "compactions", Told::kExactly, "SELECT count(*) FROM compactions"},
    {Counter::kCompacted, "compacted", Told::kExactly, "SELECT count(*) FROM tombstones"},
    {Counter::kFusionRules, "fusion_rules", Told::kAtLeast, "SELECT 0"},  // unknown
    {Counter::kEvents, "events", Told::kExactly, "SELECT coalesce(max(id), 0) FROM events"},
};

// Numbers that may have been given to something of which no row is left.
constexpr std::uint64_t kSkipped = 1 << 20;

std::uint64_t Count(Connection& connection, const Recount& recount) {
  Query row = connection.Prepare(recount.sql);
  return row.Step() ? row.Unsigned() : 0;
}

std::uint64_t SafeValue(Connection& connection, const Recount& recount) {
  const std::uint64_t told = Count(connection, recount);
  const bool is_number = recount.told == Told::kAtLeast && recount.counter != Counter::kFusionRules;
  return is_number ? told + kSkipped : told;
}

// That every index has the rows of its table, and every page its place.
Status CheckStructure(Connection& connection) {
  Query row = connection.Prepare("PRAGMA integrity_check(1)");
  const std::string found = row.Step() ? row.Text() : std::string("no answer");
  return found == "ok" ? Status() : Status(StatusCode::kInvalidData, StrCat("store: ", found));
}

}  // namespace

Status CheckCounters(Connection& connection) {
  ATLAS_RETURN_IF_ERROR(CheckSchema(connection));  // else what is counted is something else
  std::string findings;
  const auto add = [&findings](const std::string& finding) {
    findings += StrCat(findings.empty() ? "" : "; ", finding);
  };
  for (const Recount& recount : kRecounts) {
    const std::uint64_t found = Count(connection, recount);
    const std::uint64_t counted = ReadCounter(connection, recount.counter);
    if (recount.told == Told::kExactly ? found != counted : found > counted) {
      add(StrCat("store: counter ", recount.name, " is ", counted, ", and the rows say ", found));
    }
  }
  for (const auto check : {&CheckTableSums, &CheckIndexes, &CheckStructure, &CheckEvents,
                           &CheckPoseBatches, &CheckStarts, &CheckDamagedKeyframes}) {
    if (const Status status = check(connection); status.code() == StatusCode::kInvalidData) {
      add(status.message());
    } else if (!status.ok()) {
      return status;
    }
  }
  return findings.empty() ? Status() : Status(StatusCode::kInvalidData, findings);
}

int RecountCounters(Connection& connection) {
  int changed = 0;
  for (const Recount& recount : kRecounts) {
    const std::uint64_t found = Count(connection, recount);
    if (recount.told == Told::kExactly && ReadCounter(connection, recount.counter) != found) {
      SetCounter(connection, recount.counter, found);
      ++changed;
    }
  }
  return changed;
}

int RestoreCounters(Connection& connection) {
  connection.WriteDeferred();
  const bool is_ordered = PutTablesInOrder(connection, OrderedTables::kCounters, {}).empty();
  std::string names = is_ordered ? "" : "their order";
  int restored = is_ordered ? 0 : 1;
  for (const Recount& recount : kRecounts) {
    if (IsCounterIntact(connection, recount.counter)) {
      continue;
    }
    RewriteCounter(connection, recount.counter, recount.name, SafeValue(connection, recount));
    names += StrCat(names.empty() ? "" : ", ", recount.name);
    ++restored;
  }
  if (restored > 0) {
    WriteTableSum(connection, RowKind::kCounter);
    AddEvent(connection, {EventKind::kCountersRestored, kAtlasItself, names, "damaged or missing"});
  }
  return restored;
}

}  // namespace atlas
