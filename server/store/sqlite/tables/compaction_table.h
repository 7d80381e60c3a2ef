// Tables compactions and tombstones: what was dropped for good, and enough of each dropped keyframe
// to answer whoever sends it again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

struct CompactionRow {
  std::int64_t id = 0;
  std::uint64_t revision = 0;
  std::int64_t before_ms = 0;
  std::string author;
  std::uint64_t dropped = 0;  // keyframes
  std::uint64_t bytes = 0;    // of their blobs
};
// Its checksum.
std::int64_t HashOf(const CompactionRow& row);
// Of the next one. Compactions are numbered without a gap: a damaged row that has it gets its own
// back, if that is one bit away; else it goes on having it.
std::int64_t TakeCompactionNumber(Connection& connection);
void WriteCompaction(Connection& connection, const CompactionRow& row);
void DeleteCompaction(Connection& connection, std::int64_t id);

// As its columns have it, and what is left of it.
struct StoredCompaction {
  CompactionRow row;
  std::int64_t checksum = 0;
  bool fits = true;  // no column was cut
  std::uint64_t tombstones = 0;
  std::uint64_t tombstone_bytes = 0;
};
// By their ids, damaged or not.
std::vector<StoredCompaction> ListCompactions(Connection& connection);

// A keyframe that was dropped.
struct TombstoneRow {
  std::int64_t session_id = 0;
  std::uint32_t sequence = 0;
  std::int64_t time_ms = 0;
  std::uint32_t blob_bytes = 0;
  std::uint64_t blob_hash = 0;
  std::int64_t compaction_id = 0;
};
void WriteTombstone(Connection& connection, const TombstoneRow& row);

// nullopt: there is none. kInvalidData: its row is damaged.
Result<std::optional<TombstoneRow>> FindTombstone(Connection& connection,
                                                  std::int64_t session_id,
                                                  std::uint32_t sequence);
// Whether a compaction dropped one with a sequence number between these.
bool HasTombstoneBetween(Connection& connection,
                         std::int64_t session_id,
                         std::uint32_t after,
                         std::uint32_t before);
// The revision of the last compaction that dropped keyframes of a session, as its row says it; 0:
// none did.
std::uint64_t LastCompactionOf(Connection& connection, std::int64_t session_id);
// As the columns of one have it that is damaged: a number may be none that a keyframe has.
struct TombstoneKey {
  std::int64_t session_id = 0;
  std::int64_t sequence = 0;
};
std::vector<TombstoneKey> ListDamagedTombstones(Connection& connection);
void DeleteTombstone(Connection& connection, const TombstoneKey& key);
// All of a session, and out of what their compactions say that they dropped. How many.
Result<std::uint64_t> DeleteTombstones(Connection& connection, std::int64_t session_id);

// kInvalidData when a tombstone of the session is damaged, or there are not as many as `expected`.
Status CheckTombstones(Connection& connection, std::int64_t session_id, std::uint64_t expected);
// kInvalidData when a compaction's row is damaged, or there are not as many tombstones as it says.
Status CheckCompactionRows(Connection& connection);

}  // namespace atlas
