#include "server/store/sqlite/transactions/damage_transactions.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <set>
#include <utility>
#include <vector>

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/schema_check.h"
#include "server/store/sqlite/schema/table_order.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/damaged_keyframe_table.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_row.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_batch_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/sqlite/tables/tile_table.h"
#include "server/store/sqlite/transactions/compaction_repairs.h"
#include "server/store/sqlite/transactions/counter_check.h"
#include "server/store/sqlite/transactions/history_horizon.h"
#include "server/store/sqlite/transactions/index_repairs.h"
#include "server/store/sqlite/transactions/key_repairs.h"
#include "server/store/sqlite/transactions/session_repairs.h"
#include "server/store/sqlite/transactions/transactions.h"

namespace atlas {
namespace {

std::int64_t NowMs() {
  using std::chrono::milliseconds;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<milliseconds>(now).count();
}

// Dropped by a compaction, say, since somebody saw it: nothing is left of it.
bool IsGone(Connection& connection, std::int64_t id) {
  Query row = connection.Prepare(
      "SELECT EXISTS (SELECT 1 FROM keyframes WHERE id = ?1) "
      "OR EXISTS (SELECT 1 FROM poses WHERE keyframe_id = ?1) "
      "OR EXISTS (SELECT 1 FROM keyframe_tiles WHERE keyframe_id = ?1)");
  row.Bind(id);
  return row.Step() && row.Int() == 0;
}

// For people: its key where the rows still tell it.
std::string NameOf(Connection& connection, std::int64_t id) {
  const auto row = ReadKeyframeRow(connection, id);
  const auto session =
      row ? ReadSession(connection, row->session_id) : Result<SessionRow>(Error(row.error()));
  return session ? StrCat("keyframe ", KeyframeKey{session->record.key, row->record.key.sequence})
                 : StrCat("keyframe number ", id);
}

// Its tiles are built again, by surveys that are made anew.
std::uint32_t MarkFootprint(Connection& connection, std::int64_t id, std::uint64_t revision) {
  const std::vector<TileId> tiles = ReadFootprintUnchecked(connection, id);
  for (const TileId& tile : tiles) {
    MarkTile(connection, tile, revision, revision);
  }
  return static_cast<std::uint32_t>(tiles.size());
}

// The session's row, then the pose. True when that made a difference.
bool RestoreFromOthers(Connection& connection, std::int64_t id) {
  bool is_changed = false;
  if (const auto row = ReadKeyframeRow(connection, id)) {
    if (!ReadSession(connection, row->session_id)) {
      is_changed = RestoreSession(connection, row->session_id, Vouching::kByChecksum).ok();
    }
  }
  return RestorePose(connection, id, kAtlasItself) || is_changed;
}

// In the map again, by itself.
std::uint32_t NoteHealed(Connection& connection,
                         std::int64_t id,
                         const std::string& author,
                         const std::string& how,
                         std::uint64_t revision) {
  DeleteDamagedKeyframe(connection, id);
  AddEvent(connection, {EventKind::kKeyframeHealed, author, NameOf(connection, id), how});
  return MarkFootprint(connection, id, revision);
}

// At which it was uploaded.
std::uint64_t FirstRevision(Connection& connection, std::int64_t id) {
  std::uint64_t first = ReadCounter(connection, Counter::kRevision);
  for (const auto& line : ReadPoseHistory(connection, id)) {
    if (line) {
      first = std::min(first, line->revision);
    }
  }
  return first;
}

// Since its footprint was told. One whose pose cannot be read is none: it is restored first.
bool IsMoved(Connection& connection, const KeyframeRepair& repair) {
  const auto pose = ReadPose(connection, repair.id);
  return pose && *pose != repair.pose;
}

void GiveUp(Connection& connection, const KeyframeRepair& repair, const Status& why) {
  const std::string name = NameOf(connection, repair.id);
  std::set<TileId> tiles;
  for (const TileId& tile : ReadFootprintUnchecked(connection, repair.id)) {
    tiles.insert(tile);
  }
  if (repair.footprint) {
    tiles.insert(repair.footprint->begin(), repair.footprint->end());
  }
  DeleteFootprint(connection, repair.id);
  DeletePoses(connection, repair.id);
  DeleteKeyframe(connection, repair.id);
  DeleteDamagedKeyframe(connection, repair.id);
  MoveHorizon(connection, repair.author);
  const std::uint64_t revision = NextRevision(connection);
  for (const TileId& tile : tiles) {
    MarkTile(connection, tile, revision, revision);
  }
  AddEvent(connection, {EventKind::kKeyframeGivenUp, repair.author, name,
                        StrCat(why.message(), "; ", tiles.size(), " tiles")});
}

std::uint32_t OrderTables(Connection& connection, OrderedTables which, const std::string& author) {
  const std::vector<OrderedTable> tables =
      PutTablesInOrder(connection, which, &TellKeyframeNumbers);
  for (const OrderedTable& table : tables) {
    const std::string without =
        table.left_out == 0 ? "" : StrCat(", without ", table.left_out, " of its rows");
    AddEvent(connection,
             {EventKind::kTablesRepaired, author, StrCat("table ", table.name),
              StrCat("its rows were not found by their numbers: it was written anew", without)});
  }
  return static_cast<std::uint32_t>(tables.size());
}

Result<std::uint32_t> RepairRows(Connection& connection,
                                 std::uint8_t levels,
                                 const std::string& author) {
  auto repaired = static_cast<std::uint32_t>(RestoreCounters(connection));
  repaired += static_cast<std::uint32_t>(RestoreIndexes(connection));
  repaired += OrderTables(connection, OrderedTables::kTiles, author);
  repaired += OrderTables(connection, OrderedTables::kFootprints, author);
  repaired += PutBackLostTiles(connection);
  {
    const ToleratedIndexes tolerated(connection);
    repaired += RestoreTileRows(connection);
  }
  const SessionNames names = ReadDamagedNames(connection);
  repaired += RepairKeys(connection, author);
  repaired += OrderTables(connection, OrderedTables::kOthers, author);
  repaired += RepairCompactions(connection, author);
  repaired += RepairStarts(connection, author);
  repaired += static_cast<std::uint32_t>(RepairEvents(connection));
  repaired += static_cast<std::uint32_t>(RepairPoseBatches(connection));
  // Who looks at all keyframes behind this finds again what is damaged.
  repaired += static_cast<std::uint32_t>(ForgetUnknownDamage(connection));
  const auto sessions = RepairSessions(connection, names, author);
  if (!sessions) {
    return Error(sessions.error());
  }
  repaired += *sessions;
  if (const Status marks = CheckMarks(connection); !marks.ok()) {
    MarkAllInStore(connection, marks.message(), levels);
    ++repaired;
  }
  return repaired;
}

// Tables of which tiles are made, now and at earlier revisions. A row that vanished left nothing
// that tells which tiles.
bool HasLostWhatTilesAreMadeOf(Connection& connection) {
  constexpr std::array kMadeOf{RowKind::kKeyframe,    RowKind::kFootprint, RowKind::kPose,
                               RowKind::kPoseHistory, RowKind::kSession,   RowKind::kSessionState};
  return std::any_of(kMadeOf.begin(), kMadeOf.end(),
                     [&](RowKind table) { return !CheckTableSum(connection, table).ok(); });
}

Result<std::uint32_t> RepairSums(Connection& connection,
                                 std::uint8_t levels,
                                 const std::string& author) {
  auto repaired = static_cast<std::uint32_t>(RecountSessions(connection));
  repaired += static_cast<std::uint32_t>(RecountCounters(connection));
  if (const Status sums = CheckTableSums(connection); !sums.ok()) {
    const bool are_tiles_others = HasLostWhatTilesAreMadeOf(connection);
    WriteTableSums(connection);
    ++repaired;
    AddEvent(connection, {EventKind::kTablesRepaired, author, "", sums.message()});
    if (are_tiles_others) {
      MoveHorizon(connection, author);
      MarkAllInStore(connection, "rows vanished", levels);
    }
  }
  return repaired;
}

}  // namespace

std::uint32_t NoteDamageInStore(Connection& connection, std::span<const std::int64_t> keyframes) {
  std::uint32_t noted = 0;
  for (const std::int64_t id : keyframes) {
    Status status = CheckKeyframe(connection, id);
    if (status.ok() || IsGone(connection, id)) {
      continue;
    }
    if (RestoreFromOthers(connection, id) && CheckKeyframe(connection, id).ok()) {
      NoteHealed(connection, id, kAtlasItself, status.message(), NextRevision(connection));
      continue;
    }
    if (IsListedAsDamaged(connection, id)) {
      continue;
    }
    const std::uint64_t revision = ReadCounter(connection, Counter::kRevision);
    WriteDamagedKeyframe(connection, {id, revision, NowMs(), status.message()});
    AddEvent(connection,
             {EventKind::kKeyframeDamaged, kAtlasItself, NameOf(connection, id), status.message()});
    ++noted;
  }
  return noted;
}

Result<std::optional<PutKeyframeResult>> HealInStore(Connection& connection,
                                                     std::int64_t session_id,
                                                     const NewKeyframe& keyframe) {
  const std::int64_t id = FindKeyframeId(connection, session_id, keyframe.key.sequence);
  if (id == 0) {
    return std::nullopt;
  }
  const auto row = ReadKeyframeRow(connection, id);
  const std::uint64_t stored = Hash64(ReadBlobUnchecked(connection, id));
  const std::uint64_t sent = Hash64(keyframe.blob);
  const std::uint64_t vouched = row ? row->blob_hash : stored;
  if (row &&
      (stored == row->blob_hash || sent != vouched || keyframe.time_ms != row->record.time_ms)) {
    return std::nullopt;  // intact, or another keyframe: a duplicate or a conflict
  }
  if (sent != vouched) {
    return Error(row.error());
  }
  RestoreKeyframe(connection, keyframe, id, session_id, FirstRevision(connection, id));
  const std::uint64_t revision = NextRevision(connection);
  const std::uint32_t marked =
      NoteHealed(connection, id, keyframe.key.session.vehicle, "sent again", revision);
  return PutKeyframeResult{true, revision, marked};
}

Result<RepairOutcome> RepairKeyframeInStore(Connection& connection, const KeyframeRepair& repair) {
  const auto check = [&] {
    return StatusOf([&]() -> Status {
      ATLAS_RETURN_IF_ERROR(CheckKeyframe(connection, repair.id));
      const auto verified = VerifyKeyframeRecord(connection, repair.id);
      if (!verified) {
        return verified.error();
      }
      return !repair.footprint || ReadFootprint(connection, repair.id) == *repair.footprint
                 ? Status()
                 : Status(StatusCode::kInvalidData, StrCat("store: keyframe ", repair.id,
                                                           " lists other tiles than it touches"));
    });
  };
  const Status damage = check();
  if (damage.ok() || IsGone(connection, repair.id)) {
    return DeleteDamagedKeyframe(connection, repair.id) ? RepairOutcome::kRestored
                                                        : RepairOutcome::kIntact;
  }
  if (repair.footprint && IsMoved(connection, repair)) {
    return RepairOutcome::kDamaged;
  }
  RestoreFromOthers(connection, repair.id);
  if (!check().ok() && repair.footprint) {
    MoveHorizon(connection, repair.author);
    RestoreFootprint(connection, repair.id, *repair.footprint, LastChange(connection, repair.id));
  }
  if (!check().ok() && CheckKeyframe(connection, repair.id).ok() && repair.gives_up &&
      DeleteDamagedPoses(connection, repair.id) > 0) {
    MoveHorizon(connection, repair.author);  // where it was once, nobody knows any more
  }
  if (check().ok()) {
    NoteHealed(connection, repair.id, repair.author, damage.message(), NextRevision(connection));
    return RepairOutcome::kRestored;
  }
  if (!repair.gives_up) {
    return RepairOutcome::kDamaged;
  }
  GiveUp(connection, repair, damage);
  return RepairOutcome::kGivenUp;
}

Result<std::uint32_t> RepairTablesInStore(Connection& connection,
                                          TableRepair what,
                                          std::uint8_t levels,
                                          const std::string& author) {
  // What is written by another schema is no row of an atlas.
  if (Status schema = CheckSchema(connection); !schema.ok()) {
    return Error(std::move(schema));
  }
  switch (what) {
    case TableRepair::kIndexes:
      return RepairIndexes(connection, levels, author);
    case TableRepair::kRows:
      return RepairRows(connection, levels, author);
    case TableRepair::kSums:
      break;
  }
  return RepairSums(connection, levels, author);
}

}  // namespace atlas
