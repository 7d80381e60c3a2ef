#include "server/store/sqlite/transactions/compaction_transactions.h"

#include <map>
#include <set>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"

namespace atlas {
namespace {

// What a session loses.
struct Loss {
  std::uint64_t keyframes = 0;
  std::uint64_t bytes = 0;
};

// Leaves a tombstone in the place of a keyframe.
Result<TombstoneRow> DropKeyframe(Connection& connection,
                                  std::int64_t id,
                                  std::int64_t compaction_id) {
  const auto row = ReadKeyframeRow(connection, id);
  if (!row) {
    return Error(row.error());
  }
  const TombstoneRow tombstone{row->session_id, row->record.key.sequence, row->record.time_ms,
                               row->blob_bytes, row->blob_hash,           compaction_id};
  DeleteFootprint(connection, id);
  DeletePoses(connection, id);
  DeleteKeyframe(connection, id);
  WriteTombstone(connection, tombstone);
  return tombstone;
}

Status CountOut(Connection& connection, std::int64_t session_id, const Loss& loss) {
  auto session = ReadSession(connection, session_id);
  if (!session) {
    return session.error();
  }
  session->record.keyframes -= loss.keyframes;
  session->record.bytes -= loss.bytes;
  session->record.compacted += loss.keyframes;
  WriteSession(connection, *session);
  return {};
}

// What the plan was made of is still there: every change of a tile's keyframes is in its
// footprints, but what a compaction dropped.
Status CheckStoodStill(Connection& connection, const Compaction& compaction) {
  const std::uint64_t since = compaction.at_revision;
  const std::uint64_t revision = ReadCounter(connection, Counter::kRevision);
  if (since > revision || since < ReadCounter(connection, Counter::kHistoryHorizon)) {
    return {StatusCode::kConflict,
            StrCat("compaction: found out at revision ", since, ", the atlas is at ", revision)};
  }
  std::set<TileId> tiles;
  for (const std::int64_t id : compaction.dropped) {
    for (const TileId& tile : ReadFootprint(connection, id)) {
      if (tiles.insert(tile).second && !FootprintsSince(connection, tile, since).empty()) {
        return {StatusCode::kConflict,
                StrCat("compaction: tile ", tile, " changed since revision ", since)};
      }
    }
  }
  return {};
}

// Returns the atlas' revision, which is the oldest that can be read from here on.
std::uint64_t MoveHorizon(Connection& connection) {
  const std::uint64_t revision = NextRevision(connection);
  const std::uint64_t before = ReadCounter(connection, Counter::kHistoryHorizon);
  return AddToCounter(connection, Counter::kHistoryHorizon,
                      static_cast<std::int64_t>(revision - before));
}

}  // namespace

Result<CompactionResult> CompactInStore(Connection& connection, const Compaction& compaction) {
  if (Status status = CheckStoodStill(connection, compaction); !status.ok()) {
    return Error(std::move(status));
  }
  if (compaction.dropped.empty()) {
    return CompactionResult{0, 0, ReadCounter(connection, Counter::kHistoryHorizon),
                            ReadCounter(connection, Counter::kRevision)};
  }
  const std::int64_t id = TakeCompactionNumber(connection);
  CompactionResult result{compaction.dropped.size(), 0, 0, 0};
  std::map<std::int64_t, Loss> losses;  // by session
  for (const std::int64_t keyframe : compaction.dropped) {
    const auto tombstone = DropKeyframe(connection, keyframe, id);
    if (!tombstone) {
      return Error(tombstone.error());
    }
    Loss& loss = losses[tombstone->session_id];
    ++loss.keyframes;
    loss.bytes += tombstone->blob_bytes;
    result.bytes += tombstone->blob_bytes;
  }
  for (const auto& [session_id, loss] : losses) {
    if (Status status = CountOut(connection, session_id, loss); !status.ok()) {
      return Error(std::move(status));
    }
  }
  const auto dropped = static_cast<std::int64_t>(result.dropped);
  AddToCounter(connection, Counter::kKeyframes, -dropped);
  AddToCounter(connection, Counter::kKeyframeBytes, -static_cast<std::int64_t>(result.bytes));
  AddToCounter(connection, Counter::kCompacted, dropped);
  result.revision = MoveHorizon(connection);
  result.horizon = result.revision;
  WriteCompaction(connection, {id, result.revision, compaction.before_ms, compaction.author,
                               result.dropped, result.bytes});
  AddEvent(connection, {EventKind::kCompact, compaction.author, StrCat("compaction ", id),
                        StrCat(result.dropped, " keyframes, ", result.bytes, " bytes")});
  return result;
}

}  // namespace atlas
