#include "server/store/sqlite/tables/dirty_table.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/tile_ranges.h"

namespace atlas {
namespace {

// Leases and attempts are of this start alone, and are not part of it.
std::int64_t HashOf(const TileClaim& claim) {
  return RowHash(RowKind::kDirtyTile)
      .Unsigned(claim.id.Key())
      .Unsigned(claim.generation)
      .Unsigned(claim.since)
      .value();
}

struct Mark {
  std::uint64_t key = 0;
  std::uint64_t generation = 0;
  std::uint64_t since = 0;
};

void WriteMark(Connection& connection, const Mark& mark) {
  connection
      .Prepare(
          "INSERT INTO dirty_tiles (key, shard, level, generation, since, checksum) "
          "VALUES (?1,?2,?3,?4,?5, row_hash(14, ?1, ?4, ?5)) "
          "ON CONFLICT (key) DO UPDATE SET generation = excluded.generation, "
          "since = min(since, excluded.since), attempts = 0, retry_at_ms = 0, "
          "checksum = row_hash(14, key, excluded.generation, min(since, excluded.since))")
      .Bind(mark.key)
      .Bind(ShardOf(*TileId::FromKey(mark.key)))
      .Bind(std::int64_t{TileId::FromKey(mark.key)->level})
      .Bind(mark.generation)
      .Bind(mark.since)
      .Run();
}

// Marks of a transaction, in the order in which they came; those before `written_` are in the
// table.
class LateMarks final : public Deferred {
 public:
  void Add(const Mark& mark, Connection& connection) {
    marks_.push_back(mark);
    if (marks_.size() - written_ >= kMost) {
      Write(connection);
    }
  }

  // Of those on one tile the last one tells the generation, as revisions rise.
  void Write(Connection& connection) override {
    std::vector<Mark> marks(marks_.begin() + static_cast<std::ptrdiff_t>(written_), marks_.end());
    std::stable_sort(marks.begin(), marks.end(),
                     [](const Mark& a, const Mark& b) { return a.key < b.key; });
    for (auto mark = marks.begin(); mark != marks.end();) {
      Mark merged = *mark;
      for (; mark != marks.end() && mark->key == merged.key; ++mark) {
        merged = {mark->key, mark->generation, std::min(merged.since, mark->since)};
      }
      WriteMark(connection, merged);
    }
    written_ = marks_.size();
  }
  void Save() override { saved_ = {marks_.size(), written_}; }
  void Restore() override {
    marks_.resize(saved_.first);
    written_ = saved_.second;
  }
  void Forget() override {
    marks_.clear();
    written_ = 0;
  }

 private:
  static constexpr std::size_t kMost = 1u << 16;

  std::vector<Mark> marks_;
  std::size_t written_ = 0;
  std::pair<std::size_t, std::size_t> saved_;  // marks, and how many of them are written
};

void WriteLateMarks(Connection& connection) {
  if (LateMarks* marks = connection.FindDeferred<LateMarks>()) {
    marks->Write(connection);
  }
}

// The lowest level with a mark of the wave, leased or not: keys begin with the level.
std::optional<std::uint8_t> LowestLevel(Connection& connection, const ClaimRequest& request) {
  Query row = connection.Prepare(
      "SELECT key FROM dirty_tiles WHERE since <= ? AND retry_at_ms <= ? ORDER BY key LIMIT 1");
  row.Bind(request.wave).Bind(request.now_ms);
  if (!row.Step()) {
    return std::nullopt;
  }
  const auto id = TileId::FromKey(row.Unsigned());
  return id ? id->level : std::uint8_t{0};  // a damaged mark is found when the level is read
}

Result<std::vector<TileClaim>> FreeMarks(Connection& connection,
                                         const ClaimRequest& request,
                                         std::uint8_t level) {
  Query row = connection.Prepare(
      "SELECT key, generation, since, attempts, checksum FROM dirty_tiles "
      "WHERE key BETWEEN ? AND ? AND since <= ? "
      "AND retry_at_ms <= ? AND lease_until_ms <= ? ORDER BY key LIMIT ?");
  const KeyRange keys = LevelRange(level);
  row.Bind(keys.first).Bind(keys.last).Bind(request.wave);
  row.Bind(request.now_ms).Bind(request.now_ms).Bind(request.max_tiles);
  std::vector<TileClaim> claims;
  while (row.Step()) {
    row.Rewind();
    const std::uint64_t key = row.Unsigned();
    const auto id = TileId::FromKey(key);
    TileClaim claim{id.value_or(TileId{}), request.owner};
    claim.generation = row.Unsigned();
    claim.since = row.Unsigned();
    claim.attempts = row.Unsigned32();
    if (!id || !row.IsChecksum(HashOf(claim))) {
      return Error(StatusCode::kInvalidData, StrCat("store: the mark on the tile with the key ",
                                                    key, " is damaged: wrong checksum"));
    }
    claims.push_back(std::move(claim));
  }
  return claims;
}

// Those whose key is damaged are left out: then not all that failed are here.
std::vector<TileId> FailedTiles(Connection& connection) {
  std::vector<TileId> tiles;
  Query row = connection.Prepare("SELECT key FROM dirty_tiles WHERE attempts > 0");
  while (row.Step()) {
    row.Rewind();
    if (const auto id = TileId::FromKey(row.Unsigned())) {
      tiles.push_back(*id);
    }
  }
  return tiles;
}

}  // namespace

void MarkAtTheEnd(Connection& connection) {
  connection.Defer(std::make_unique<LateMarks>());
}

void MarkTile(Connection& connection,
              const TileId& id,
              std::uint64_t generation,
              std::uint64_t since) {
  const Mark mark{id.Key(), generation, since};
  if (LateMarks* marks = connection.FindDeferred<LateMarks>()) {
    marks->Add(mark, connection);
  } else {
    WriteMark(connection, mark);
  }
}

Result<ClaimResult> ClaimTiles(Connection& connection, const ClaimRequest& request) {
  WriteLateMarks(connection);
  const auto level = LowestLevel(connection, request);
  if (!level) {
    return ClaimResult{{}, true};
  }
  auto marks = FreeMarks(connection, request, *level);
  if (!marks) {
    return Error(marks.error());
  }
  ClaimResult result{std::move(*marks), false};
  for (const TileClaim& claim : result.claims) {
    connection.Prepare("UPDATE dirty_tiles SET lease_owner = ?, lease_until_ms = ? WHERE key = ?")
        .Bind(std::string_view(request.owner))
        .Bind(request.now_ms + request.lease_ms)
        .Bind(claim.id.Key())
        .Run();
  }
  return result;
}

Status CheckClaim(Connection& connection, const TileClaim& claim) {
  WriteLateMarks(connection);
  Query row = connection.Prepare("SELECT coalesce(lease_owner, '') FROM dirty_tiles WHERE key = ?");
  row.Bind(claim.id.Key());
  if (row.Step() && row.Text() == claim.owner) {
    return {};
  }
  return Status(StatusCode::kConflict,
                StrCat("store: tile ", claim.id, " is no longer leased to ", claim.owner));
}

void SettleClaim(Connection& connection, const TileClaim& claim) {
  WriteLateMarks(connection);
  const int cleared = connection.Prepare("DELETE FROM dirty_tiles WHERE key = ? AND generation = ?")
                          .Bind(claim.id.Key())
                          .Bind(claim.generation)
                          .Run();
  if (cleared != 0) {
    return;
  }
  connection
      .Prepare(
          "UPDATE dirty_tiles SET since = ?1, lease_owner = NULL, lease_until_ms = 0, "
          "checksum = row_hash(14, key, generation, ?1) WHERE key = ?2")
      .Bind(claim.generation + 1)
      .Bind(claim.id.Key())
      .Run();
}

void PostponeClaim(Connection& connection, const TileClaim& claim, std::int64_t retry_at_ms) {
  WriteLateMarks(connection);
  connection
      .Prepare(
          "UPDATE dirty_tiles SET lease_owner = NULL, lease_until_ms = 0, "
          "attempts = attempts + (? > 0 AND generation = ?), "
          "retry_at_ms = iif(generation = ?, ?, 0) WHERE key = ?")
      .Bind(retry_at_ms)
      .Bind(claim.generation)
      .Bind(claim.generation)
      .Bind(retry_at_ms)
      .Bind(claim.id.Key())
      .Run();
}

void DropAllLeases(Connection& connection) {
  connection.Execute(
      "UPDATE dirty_tiles SET lease_owner = NULL, lease_until_ms = 0, attempts = 0, "
      "retry_at_ms = 0 WHERE lease_until_ms <> 0 OR retry_at_ms <> 0");
}

Status CheckMarks(Connection& connection) {
  WriteLateMarks(connection);
  ATLAS_RETURN_IF_ERROR(CheckTableSum(connection, RowKind::kDirtyTile));
  Query row =
      connection.Prepare("SELECT key, shard, level, generation, since, checksum FROM dirty_tiles");
  std::uint64_t damaged = 0;
  while (row.Step()) {
    row.Rewind();
    const auto id = TileId::FromKey(row.Unsigned());
    const std::int64_t shard = row.Int();
    const std::int64_t level = row.Int();
    TileClaim mark{id.value_or(TileId{}), {}};
    mark.generation = row.Unsigned();
    mark.since = row.Unsigned();
    // Shard and level follow from the key: they are in no checksum.
    const bool is_whole = row.IsChecksum(HashOf(mark)) && id && shard == ShardOf(*id) &&
                          level == std::int64_t{id->level};
    damaged += is_whole ? 0 : 1;
  }
  return damaged == 0 ? Status()
                      : Status(StatusCode::kInvalidData,
                               StrCat("store: marks on ", damaged, " tiles are damaged"));
}

void ForgetMarks(Connection& connection) {
  WriteLateMarks(connection);
  const ToleratedIndexes tolerated(connection);
  connection.Execute("DELETE FROM dirty_tiles; REINDEX dirty_tiles");
  WriteTableSum(connection, RowKind::kDirtyTile);
}

DirtyState ReadDirty(Connection& connection) {
  WriteLateMarks(connection);
  DirtyState state;
  std::uint64_t failed = 0;
  state.revision = ReadCounter(connection, Counter::kRevision);
  Query row = connection.Prepare(
      "SELECT count(*), coalesce(sum(attempts > 0), 0), coalesce(min(since), 0) FROM dirty_tiles");
  if (row.Step()) {
    state.dirty_tiles = row.Unsigned();
    failed = row.Unsigned();
    state.oldest_since = row.Unsigned();
  }
  if (failed != 0 && failed == state.dirty_tiles) {
    state.failed_tiles = FailedTiles(connection);
  }
  return state;
}

}  // namespace atlas
