#include "server/store/sqlite/transactions/current_reads.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/session_table.h"

namespace atlas {

Result<FoundKeyframes> FindKeyframeRecords(Connection& connection,
                                           std::span<const KeyframeKey> keys) {
  FoundKeyframes records;
  for (const KeyframeKey& key : keys) {
    auto record = FindKeyframeRecord(connection, key);
    if (!record) {
      return Error(record.error());
    }
    records.push_back(std::move(*record));
  }
  return records;
}

std::vector<std::int64_t> ListKeyframeRows(Connection& connection,
                                           std::int64_t after_id,
                                           std::uint32_t limit) {
  Query row = connection.Prepare(
      "SELECT id FROM (SELECT id FROM keyframes WHERE id > ?1 ORDER BY id LIMIT ?2) "
      "UNION SELECT id FROM (SELECT keyframe_id AS id FROM poses WHERE keyframe_id > ?1 "
      "ORDER BY keyframe_id LIMIT ?2) "
      "UNION SELECT id FROM (SELECT DISTINCT keyframe_id AS id FROM keyframe_tiles "
      "WHERE keyframe_id > ?1 ORDER BY keyframe_id LIMIT ?2) ORDER BY id LIMIT ?2");
  row.Bind(after_id).Bind(limit);
  std::vector<std::int64_t> ids;
  while (row.Step()) {
    row.Rewind();
    ids.push_back(row.Int());
  }
  return ids;
}

Result<std::optional<SessionRecord>> FindSessionRecord(Connection& connection,
                                                       const SessionKey& key) {
  auto row = FindSession(connection, key);
  if (!row) {
    return Error(row.error());
  }
  return *row ? std::optional((*row)->record) : std::nullopt;
}

Result<KeyframePage> ReadKeyframePage(Connection& connection,
                                      const SessionKey& session,
                                      std::optional<std::uint32_t> after_sequence,
                                      std::uint32_t limit) {
  const auto row = FindSession(connection, session);
  if (!row) {
    return Error(row.error());
  }
  if (!*row) {
    return Error(StatusCode::kNotFound, StrCat("session ", session, " is not in the atlas"));
  }
  std::vector<std::int64_t> ids = ListKeyframesBehind(
      connection, (*row)->id, after_sequence ? std::int64_t{*after_sequence} : -1, limit + 1U);
  KeyframePage page;
  page.has_more = ids.size() > limit;
  ids.resize(std::min<std::size_t>(ids.size(), limit));
  for (const std::int64_t id : ids) {
    auto record = ReadKeyframeRecord(connection, id);
    if (!record) {
      return Error(record.error());
    }
    page.keyframes.push_back(*std::move(record));
  }
  return page;
}

Result<StoredKeyframe> VerifyStoredKeyframe(Connection& connection, std::int64_t id) {
  auto record = VerifyKeyframeRecord(connection, id);
  if (!record) {
    return Error(record.error());
  }
  return StoredKeyframe{*std::move(record), ReadFootprint(connection, id)};
}

Result<TileSources> GatherTileSources(Connection& connection,
                                      const TileId& id,
                                      std::uint64_t since) {
  TileSources sources;
  sources.revision = ReadCounter(connection, Counter::kRevision);
  sources.is_whole = since < ReadCounter(connection, Counter::kHistoryHorizon) || since == 0;
  for (const FootprintRow& row : FootprintsSince(connection, id, sources.is_whole ? 0 : since)) {
    if (!row.is_current) {
      sources.gone.push_back(row.keyframe_id);
      continue;
    }
    auto record = ReadKeyframeRecord(connection, row.keyframe_id);
    if (!record) {
      return Error(record.error());
    }
    if (IsInMap(record->session_state)) {
      sources.keyframes.push_back(std::move(*record));
    } else {
      sources.gone.push_back(row.keyframe_id);
    }
  }
  return sources;
}

StoreCounts ReadStoreCounts(Connection& connection) {
  StoreCounts counts;
  counts.revision = ReadCounter(connection, Counter::kRevision);
  counts.keyframes = ReadCounter(connection, Counter::kKeyframes);
  counts.keyframe_bytes = ReadCounter(connection, Counter::kKeyframeBytes);
  counts.compacted = ReadCounter(connection, Counter::kCompacted);
  counts.sessions = ReadCounter(connection, Counter::kSessions);
  counts.quarantined = CountQuarantined(connection);
  counts.tiles = ReadCounter(connection, Counter::kTiles);
  counts.tile_bytes = ReadCounter(connection, Counter::kTileBytes);
  counts.cells = ReadCounter(connection, Counter::kCells);
  counts.multilayer_cells = ReadCounter(connection, Counter::kMultilayerCells);
  counts.dirty_tiles = ReadDirty(connection).dirty_tiles;
  return counts;
}

}  // namespace atlas
