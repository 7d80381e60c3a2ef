#include "server/store/sqlite/backup/atlas_reading.h"

#include <exception>
#include <utility>
#include <vector>

#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "server/store/sqlite/backup/work_pace.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/damaged_keyframe_table.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_batch_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/sqlite/tables/tile_table.h"
#include "server/store/sqlite/transactions/counter_check.h"
#include "server/store/sqlite/transactions/current_reads.h"
#include "server/store/tile_hasher.h"

namespace atlas {
namespace {

constexpr std::uint32_t kPage = 1'024;  // rows
constexpr int kCache_kib = 8 * 1024;

class Reading {
 public:
  Reading(Connection& connection, const BackupWork& work, std::uint64_t bytes)
      : connection_(connection),
        work_(work),
        pace_(work, BackupProgress::Stage::kVerifying, bytes) {}

  Status Run(AtlasFacts& facts) {
    ATLAS_RETURN_IF_ERROR(pace_.Reach(0));
    ATLAS_RETURN_IF_ERROR(CheckCounters(connection_));  // and sums, indexes and pages
    ATLAS_RETURN_IF_ERROR(CheckMarks(connection_));
    ATLAS_RETURN_IF_ERROR(CheckSessions());
    ATLAS_RETURN_IF_ERROR(CheckCompactionRows(connection_));
    ATLAS_RETURN_IF_ERROR(CheckPoseBatches(connection_));
    ATLAS_RETURN_IF_ERROR(CheckStarts(connection_));
    ATLAS_RETURN_IF_ERROR(CheckEvents());
    ATLAS_RETURN_IF_ERROR(CheckKeyframes(facts.keyframes));
    return HashTiles(facts);
  }

 private:
  Status CheckSessions() {
    for (SessionKey after;;) {
      const auto sessions = ReadSessions(connection_, after, kPage);
      if (!sessions) {
        return sessions.error();
      }
      if (sessions->empty()) {
        return {};
      }
      for (const SessionRecord& session : *sessions) {
        ATLAS_RETURN_IF_ERROR(work_.check_stop());
        ATLAS_RETURN_IF_ERROR(CheckSessionHistory(connection_, session.key));
      }
      after = sessions->back().key;
    }
  }

  Status CheckEvents() {
    for (std::uint64_t after = 0;;) {
      const auto events = ReadEvents(connection_, after, kPage);
      if (!events) {
        return events.error();
      }
      if (events->empty()) {
        return {};
      }
      ATLAS_RETURN_IF_ERROR(work_.check_stop());
      after = events->back().id;
    }
  }

  Status CheckKeyframes(std::uint64_t& count) {
    if (const auto damaged = ReadDamagedKeyframes(connection_); !damaged) {
      return damaged.error();
    }
    for (std::int64_t after = 0;;) {
      const std::vector<std::int64_t> ids = ListKeyframeRows(connection_, after, kPage);
      if (ids.empty()) {
        return {};
      }
      for (const std::int64_t id : ids) {
        ATLAS_RETURN_IF_ERROR(CheckOne(id));
        ++count;
      }
      after = ids.back();
    }
  }
  Status CheckOne(std::int64_t id) {
    if (const auto record = VerifyKeyframeRecord(connection_, id); !record) {
      return record.error();
    }
    ATLAS_RETURN_IF_ERROR(CheckKeyframe(connection_, id));
    return pace_.Add(ReadBlobUnchecked(connection_, id).size());
  }

  Status HashTiles(AtlasFacts& facts) {
    TileHasher hasher;
    for (std::int64_t after = -1;;) {
      const std::vector<TileSummary> tiles = ListTileRows(connection_, after, kPage);
      if (tiles.empty()) {
        break;
      }
      for (const TileSummary& tile : tiles) {
        ATLAS_RETURN_IF_ERROR(HashTile(tile.id, hasher));
      }
      after = static_cast<std::int64_t>(tiles.back().id.Key());
    }
    facts.tiles = hasher.tiles();
    const auto sha256 = hasher.Finish();
    if (!sha256) {
      return sha256.error();
    }
    facts.sha256 = *sha256;
    return {};
  }
  Status HashTile(const TileId& id, TileHasher& hasher) {
    const auto tile = ReadTileRow(connection_, id);
    if (!tile) {
      return tile.error();
    }
    const auto payload = *tile ? work_.payload_of((*tile)->blob)
                               : Result<Bytes>(Error(StatusCode::kInvalidData, "it is not there"));
    if (!payload || Hash64(*payload) != (*tile)->payload_hash) {
      return {StatusCode::kInvalidData,
              StrCat("store: tile ", id, " is damaged",
                     payload ? ": wrong hash" : ": " + payload.error().message())};
    }
    hasher.Add(id, *payload);
    return pace_.Add((*tile)->blob.size());
  }

  Connection& connection_;
  const BackupWork& work_;
  WorkPace pace_;
};

Result<AtlasFacts> ReadBack(Connection& connection, const BackupWork& work) {
  const Snapshot snapshot(connection);
  const Result<StoreIdentity> identity = ReadIdentity(connection);
  if (!identity) {
    return Error(identity.error());
  }
  AtlasFacts facts;
  facts.atlas_id = identity->atlas_id;
  facts.epoch = identity->epoch;
  facts.bytes = static_cast<std::uint64_t>(connection.Ask("PRAGMA page_count") *
                                           connection.Ask("PRAGMA page_size"));
  facts.table_sums = HashOfTableSums(connection);
  const std::uint64_t blob_bytes = ReadCounter(connection, Counter::kKeyframeBytes) +
                                   ReadCounter(connection, Counter::kTileBytes);
  facts.revision = ReadCounter(connection, Counter::kRevision);
  Status status = Reading(connection, work, blob_bytes).Run(facts);
  return status.ok() ? Result<AtlasFacts>(facts) : Error(std::move(status));
}

// Nothing of this program's making is wrong with a file that lacks a table.
Status Failure(const std::exception& error) {
  Status status = StatusFromException(error);
  return status.code() == StatusCode::kInternal ? Status(StatusCode::kInvalidData, status.message())
                                                : status;
}

}  // namespace

Result<AtlasFacts> ReadAtlasBack(const std::filesystem::path& file, const BackupWork& work) {
  try {
    Connection connection({file, DatabaseOptions::Mode::kUntouched, kCache_kib, 0, true});
    AddRowHash(connection);
    connection.InterruptWhen([&work] { return !work.check_stop().ok(); });
    return ReadBack(connection, work);
  } catch (const std::exception& error) {
    Status stopped = work.check_stop();
    return Error(stopped.ok() ? Failure(error) : std::move(stopped));
  }
}

}  // namespace atlas
