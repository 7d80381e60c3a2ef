#include "server/store/sqlite/transactions/transactions.h"

#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/stored_bytes.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/sqlite/tables/tile_table.h"
#include "server/store/sqlite/transactions/damage_transactions.h"
#include "server/store/sqlite/transactions/session_judgement.h"
#include "server/store/sqlite/transactions/session_transition.h"

namespace atlas {
namespace {

constexpr std::uint32_t kAllRows = std::numeric_limits<std::uint32_t>::max();

// What was uploaded under a key.
struct StoredUpload {
  std::int64_t time_ms = 0;
  std::uint64_t blob_hash = 0;
  std::uint32_t blob_bytes = 0;
};

// Of a keyframe that is there, or was until a compaction dropped it.
Result<std::optional<StoredUpload>> FindUpload(Connection& connection,
                                               std::int64_t session_id,
                                               std::uint32_t sequence) {
  const auto row = FindKeyframeRow(connection, session_id, sequence);
  if (!row) {
    return Error(row.error());
  }
  if (*row) {
    return StoredUpload{(*row)->record.time_ms, (*row)->blob_hash, (*row)->blob_bytes};
  }
  const auto tombstone = FindTombstone(connection, session_id, sequence);
  if (!tombstone) {
    return Error(tombstone.error());
  }
  if (*tombstone) {
    return StoredUpload{(*tombstone)->time_ms, (*tombstone)->blob_hash, (*tombstone)->blob_bytes};
  }
  return std::nullopt;
}

bool IsSameUpload(const StoredUpload& stored, const NewKeyframe& keyframe) {
  return stored.blob_bytes == keyframe.blob.size() && stored.blob_hash == Hash64(keyframe.blob) &&
         stored.time_ms == keyframe.time_ms;
}

template <typename Tiles>
void MarkTiles(Connection& connection, const Tiles& tiles, std::uint64_t revision) {
  for (const TileId& tile : tiles) {
    MarkTile(connection, tile, revision, revision);
  }
}

PutKeyframeResult AddKeyframe(Connection& connection,
                              const NewKeyframe& keyframe,
                              const SessionRow& session) {
  const std::uint64_t revision = NextRevision(connection);
  const auto id = static_cast<std::int64_t>(
      TakeNumber(connection, Counter::kLastKeyframeId, "SELECT 1 FROM keyframes WHERE id = ?"));
  InsertKeyframe(connection, keyframe, id, session.id, revision);
  const std::string& author = keyframe.key.session.vehicle;
  WritePose(connection, {id, keyframe.pose, revision, 0, author});
  WriteFootprint(connection, id, keyframe.footprint, revision);
  if (HasNoneYet(session.record)) {
    WriteSessionState(connection, {session.id, revision, session.record.state, author, ""});
  }
  const SessionRow counted = CountKeyframe(connection, session, keyframe);
  AddToCounter(connection, Counter::kKeyframes, 1);
  AddToCounter(connection, Counter::kKeyframeBytes,
               static_cast<std::int64_t>(keyframe.blob.size()));
  PutKeyframeResult result{false, revision, 0, JudgeArrival(connection, counted, keyframe)};
  if (result.judgement) {
    result.tiles_marked = EnterJudgedState(connection, counted, *result.judgement, revision);
  } else if (IsInMap(session.record.state)) {
    MarkTiles(connection, keyframe.footprint, revision);
    result.tiles_marked = static_cast<std::uint32_t>(keyframe.footprint.size());
  }
  return result;
}

// What is stored, and what lies over keyframes: other rules may have found nothing there. Rows with
// keys that no tile has are left out, as everywhere.
std::set<TileId> AllTiles(Connection& connection, std::uint8_t levels) {
  std::set<TileId> tiles;
  for (TileId tile : ReadAllFootprints(connection)) {
    while (tiles.insert(tile).second && tile.level + 1 < levels) {
      tile = tile.Parent();
    }
  }
  for (const TileSummary& tile : ListTileRows(connection, -1, kAllRows)) {
    tiles.insert(tile.id);
  }
  return tiles;
}

Result<SessionRow> FindOrBeginSession(Connection& connection, const NewKeyframe& keyframe) {
  const SessionKey& key = keyframe.key.session;
  auto found = FindSession(connection, key);
  if (!found) {
    return Error(found.error());
  }
  if (*found) {
    return std::move(**found);
  }
  if (keyframe.start != nullptr) {
    Status status = keyframe.start->Begin(key.vehicle, SessionStarts::Clock::now());
    if (!status.ok()) {
      return Error(std::move(status));
    }
  }
  return AddSession(connection, key,
                    keyframe.is_staged ? SessionState::kStaged : SessionState::kLive);
}

Status CheckRoom(Connection& connection, const NewKeyframe& keyframe, UploadRoom& room) {
  const std::string& vehicle = keyframe.key.session.vehicle;
  const UploadLimits limits = room.limits();
  UploadSize size{vehicle, keyframe.blob.size()};
  if (limits.vehicle_bytes > 0) {
    size.vehicle_bytes = ReadVehicleBytes(connection, vehicle);
  }
  if (limits.store_bytes > 0) {
    size.used_bytes = ReadUsedBytes(connection);
  }
  return room.Check(size, UploadRoom::Clock::now());
}

}  // namespace

Result<PutKeyframeResult> PutKeyframeInStore(Connection& connection,
                                             const NewKeyframe& keyframe,
                                             UploadRoom& room) {
  const auto session = FindOrBeginSession(connection, keyframe);
  if (!session) {
    return Error(session.error());
  }
  if (session->record.state == SessionState::kPurged) {
    return Error(StatusCode::kConflict,
                 StrCat("keyframe ", keyframe.key,
                        ": its session was purged and takes none any more; use another name"));
  }
  const auto stored = FindUpload(connection, session->id, keyframe.key.sequence);
  if (stored && !*stored) {
    if (Status status = CheckRoom(connection, keyframe, room); !status.ok()) {
      return Error(std::move(status));
    }
    return AddKeyframe(connection, keyframe, *session);
  }
  const auto healed = HealInStore(connection, session->id, keyframe);
  if (!healed) {
    return Error(healed.error());
  }
  if (*healed) {
    return **healed;
  }
  if (!stored) {
    return Error(stored.error());
  }
  if (!IsSameUpload(**stored, keyframe)) {
    return Error(
        StatusCode::kConflict,
        StrCat(
            "keyframe ", keyframe.key,
            " is in the atlas with other content: another scan, time (--start), range, number of "
            "rings, --deskew, sensor height (--sensor-height) or tilt, which are estimated from "
            "scans "
            "of the whole folder and change where that has grown, or another version's way to make "
            "it; --session gives it a name of its own"));
  }
  return PutKeyframeResult{true, ReadCounter(connection, Counter::kRevision), 0};
}

Result<FinishResult> FinishTileInStore(Connection& connection,
                                       const FinishedTile& tile,
                                       std::uint8_t levels) {
  if (Status status = CheckClaim(connection, tile.claim); !status.ok()) {
    return Error(std::move(status));
  }
  FinishResult result;
  const TileId& id = tile.claim.id;
  result.is_changed = StoreTile(connection, id, tile.content, tile.fused_revision);
  if (result.is_changed) {
    result.revision = ReadCounter(connection, Counter::kRevision);
    if (id.level + 1 < levels) {
      MarkTile(connection, id.Parent(), result.revision, tile.claim.since);
    }
  }
  SettleClaim(connection, tile.claim);
  return result;
}

std::uint32_t MarkDirtyInStore(Connection& connection, const std::vector<TileId>& ids) {
  const std::uint64_t revision = NextRevision(connection);
  for (const TileId& id : ids) {
    MarkTile(connection, id, revision, kReflectsNothing);
  }
  return static_cast<std::uint32_t>(ids.size());
}

// Which marks there were is not known: no tile reflects anything for sure.
void MarkAllInStore(Connection& connection, const std::string& why, std::uint8_t levels) {
  ForgetMarks(connection);
  const std::set<TileId> tiles = AllTiles(connection, levels);
  const std::uint64_t revision = NextRevision(connection);
  for (const TileId& tile : tiles) {
    MarkTile(connection, tile, revision, kReflectsNothing);
  }
  AddEvent(connection, {EventKind::kMarksRestored, kAtlasItself, "",
                        StrCat(why, "; ", tiles.size(), " tiles")});
}

std::uint64_t AdoptFusionRulesInStore(Connection& connection,
                                      std::uint64_t rules,
                                      std::uint8_t levels) {
  if (ReadCounter(connection, Counter::kFusionRules) == rules) {
    return 0;
  }
  const std::uint64_t before = ReadCounter(connection, Counter::kFusionRules);
  const std::set<TileId> tiles = AllTiles(connection, levels);
  SetCounter(connection, Counter::kFusionRules, rules);
  if (!tiles.empty()) {
    MarkTiles(connection, tiles, NextRevision(connection));
    AddEvent(connection, {EventKind::kRules, kAtlasItself, StrCat("rules ", rules),
                          StrCat("before: ", before, "; ", tiles.size(), " tiles")});
  }
  return tiles.size();
}

Result<ClaimResult> ClaimDirtyInStore(Connection& connection,
                                      const ClaimRequest& request,
                                      std::uint8_t levels) {
  auto claimed = ClaimTiles(connection, request);
  if (claimed || claimed.error().code() != StatusCode::kInvalidData) {
    return claimed;
  }
  MarkAllInStore(connection, claimed.error().message(), levels);
  return ClaimTiles(connection, request);
}

}  // namespace atlas
