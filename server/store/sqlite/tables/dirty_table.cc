#include "server/store/sqlite/tables/dirty_table.h"

#include <optional>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/tile_ranges.h"

namespace atlas {
namespace {

// The lowest level with a mark of the wave, leased or not: keys begin with the level.
std::optional<std::uint8_t> LowestLevel(Connection& connection, const ClaimRequest& request) {
  Query row = connection.Prepare(
      "SELECT level FROM dirty_tiles WHERE since <= ? AND retry_at_ms <= ? ORDER BY key LIMIT 1");
  row.Bind(request.wave).Bind(request.now_ms);
  if (!row.Step()) {
    return std::nullopt;
  }
  return static_cast<std::uint8_t>(row.Int());
}

std::vector<TileClaim> FreeMarks(Connection& connection,
                                 const ClaimRequest& request,
                                 std::uint8_t level) {
  Query row = connection.Prepare(
      "SELECT key, generation, since, attempts FROM dirty_tiles WHERE key BETWEEN ? AND ? AND "
      "since <= ? "
      "AND retry_at_ms <= ? AND lease_until_ms <= ? ORDER BY key LIMIT ?");
  const KeyRange keys = LevelRange(level);
  row.Bind(keys.first).Bind(keys.last).Bind(request.wave);
  row.Bind(request.now_ms).Bind(request.now_ms).Bind(request.max_tiles);
  std::vector<TileClaim> claims;
  while (row.Step()) {
    row.Rewind();
    if (const auto id = TileId::FromKey(row.Unsigned())) {
      TileClaim claim{*id, request.owner};
      claim.generation = row.Unsigned();
      claim.since = row.Unsigned();
      claim.attempts = row.Unsigned32();
      claims.push_back(std::move(claim));
    }
  }
  return claims;
}

}  // namespace

void MarkTile(Connection& connection,
              const TileId& id,
              std::uint64_t generation,
              std::uint64_t since) {
  connection
      .Prepare(
          "INSERT INTO dirty_tiles (key, shard, level, generation, since) VALUES (?,?,?,?,?) "
          "ON CONFLICT (key) DO UPDATE SET generation = excluded.generation, "
          "since = min(since, excluded.since), attempts = 0, retry_at_ms = 0")
      .Bind(id.Key())
      .Bind(ShardOf(id))
      .Bind(std::int64_t{id.level})
      .Bind(generation)
      .Bind(since)
      .Run();
}

ClaimResult ClaimTiles(Connection& connection, const ClaimRequest& request) {
  const auto level = LowestLevel(connection, request);
  if (!level) {
    return {{}, true};
  }
  ClaimResult result{FreeMarks(connection, request, *level), false};
  for (const TileClaim& claim : result.claims) {
    connection
        .Prepare(
            "UPDATE dirty_tiles SET lease_owner = ?, lease_until_ms = ? WHERE key = ? "
            "AND shard = ?")
        .Bind(std::string_view(request.owner))
        .Bind(request.now_ms + request.lease_ms)
        .Bind(claim.id.Key())
        .Bind(ShardOf(claim.id))
        .Run();
  }
  return result;
}

Status CheckClaim(Connection& connection, const TileClaim& claim) {
  Query row = connection.Prepare(
      "SELECT coalesce(lease_owner, '') FROM dirty_tiles WHERE key = ? AND shard = ?");
  row.Bind(claim.id.Key()).Bind(ShardOf(claim.id));
  if (row.Step() && row.Text() == claim.owner) {
    return {};
  }
  return Status(StatusCode::kConflict,
                StrCat("store: tile ", claim.id, " is no longer leased to ", claim.owner));
}

void SettleClaim(Connection& connection, const TileClaim& claim) {
  const int cleared =
      connection.Prepare("DELETE FROM dirty_tiles WHERE key = ? AND shard = ? AND generation = ?")
          .Bind(claim.id.Key())
          .Bind(ShardOf(claim.id))
          .Bind(claim.generation)
          .Run();
  if (cleared != 0) {
    return;
  }
  connection
      .Prepare(
          "UPDATE dirty_tiles SET since = ?, lease_owner = NULL, lease_until_ms = 0 "
          "WHERE key = ? AND shard = ?")
      .Bind(claim.generation + 1)
      .Bind(claim.id.Key())
      .Bind(ShardOf(claim.id))
      .Run();
}

void PostponeClaim(Connection& connection, const TileClaim& claim, std::int64_t retry_at_ms) {
  connection
      .Prepare(
          "UPDATE dirty_tiles SET lease_owner = NULL, lease_until_ms = 0, "
          "attempts = attempts + (? > 0 AND generation = ?), "
          "retry_at_ms = iif(generation = ?, ?, 0) WHERE key = ? AND shard = ?")
      .Bind(retry_at_ms)
      .Bind(claim.generation)
      .Bind(claim.generation)
      .Bind(retry_at_ms)
      .Bind(claim.id.Key())
      .Bind(ShardOf(claim.id))
      .Run();
}

void DropAllLeases(Connection& connection) {
  connection.Execute(
      "UPDATE dirty_tiles SET lease_owner = NULL, lease_until_ms = 0, attempts = 0, "
      "retry_at_ms = 0 WHERE lease_until_ms <> 0 OR retry_at_ms <> 0");
}

DirtyState ReadDirty(Connection& connection) {
  DirtyState state;
  state.revision = ReadCounter(connection, Counter::kRevision);
  Query row = connection.Prepare(
      "SELECT count(*), coalesce(sum(attempts > 0), 0), coalesce(min(since), 0) FROM dirty_tiles");
  if (row.Step()) {
    state.dirty_tiles = row.Unsigned();
    state.failed_tiles = row.Unsigned();
    state.oldest_since = row.Unsigned();
  }
  return state;
}

}  // namespace atlas
