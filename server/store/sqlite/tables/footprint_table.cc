#include "server/store/sqlite/tables/footprint_table.h"

#include <optional>

#include "core/base/str_cat.h"
#include "server/store/tile_ranges.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxRanges = 64;

// A statement a row is a fifth slower than one for eight.
constexpr std::size_t kRowsAtOnce = 8;
constexpr const char* kAddOne =
    "INSERT INTO keyframe_tiles (tile_key, keyframe_id, revision, is_current) "
    "VALUES (?,?,?,1) "
    "ON CONFLICT DO UPDATE SET revision = excluded.revision, is_current = 1";
constexpr const char* kAddEight =
    "INSERT INTO keyframe_tiles (tile_key, keyframe_id, revision, is_current) "
    "VALUES (?,?,?,1),(?,?,?,1),(?,?,?,1),(?,?,?,1),(?,?,?,1),(?,?,?,1),(?,?,?,1),(?,?,?,1) "
    "ON CONFLICT DO UPDATE SET revision = excluded.revision, is_current = 1";

// Keys that no tile has are left out: nothing is fused for them.
std::vector<TileId> ReadKeys(Query& row) {
  std::vector<TileId> tiles;
  while (row.Step()) {
    row.Rewind();
    if (const auto id = TileId::FromKey(row.Unsigned())) {
      tiles.push_back(*id);
    }
  }
  return tiles;
}

// The first level-0 tile above `after_key` that a footprint touches or touched.
Result<std::optional<TileId>> NextTile(Connection& connection, std::int64_t after_key) {
  Query row = connection.Prepare(
      "SELECT coalesce(min(tile_key), -1) FROM keyframe_tiles WHERE tile_key > ?");
  row.Bind(after_key);
  const std::int64_t key = row.Step() ? row.Int() : -1;
  if (key < 0) {
    return std::nullopt;
  }
  const auto id = TileId::FromKey(static_cast<std::uint64_t>(key));
  if (!id || id->level != 0) {
    return Error(StatusCode::kInvalidData, "store: the index of footprints is damaged");
  }
  return *id;
}

void AddRows(Connection& connection,
             const char* sql,
             std::span<const TileId> tiles,
             std::int64_t keyframe_id,
             std::uint64_t revision) {
  Query insert = connection.Prepare(sql);
  for (const TileId& tile : tiles) {
    insert.Bind(tile.Key()).Bind(keyframe_id).Bind(revision);
  }
  insert.Run();
}

}  // namespace

std::vector<TileId> ReadFootprint(Connection& connection, std::int64_t keyframe_id) {
  Query row = connection.Prepare(
      "SELECT tile_key FROM keyframe_tiles WHERE keyframe_id = ? AND is_current "
      "ORDER BY tile_key");
  row.Bind(keyframe_id);
  return ReadKeys(row);
}

void WriteFootprint(Connection& connection,
                    std::int64_t keyframe_id,
                    std::span<const TileId> footprint,
                    std::uint64_t revision) {
  connection
      .Prepare(
          "UPDATE keyframe_tiles SET is_current = 0, revision = ? "
          "WHERE keyframe_id = ? AND is_current")
      .Bind(revision)
      .Bind(keyframe_id)
      .Run();
  while (footprint.size() >= kRowsAtOnce) {
    AddRows(connection, kAddEight, footprint.first(kRowsAtOnce), keyframe_id, revision);
    footprint = footprint.subspan(kRowsAtOnce);
  }
  for (; !footprint.empty(); footprint = footprint.subspan(1)) {
    AddRows(connection, kAddOne, footprint.first(1), keyframe_id, revision);
  }
}

void DeleteFootprint(Connection& connection, std::int64_t keyframe_id) {
  connection.Prepare("DELETE FROM keyframe_tiles WHERE keyframe_id = ?").Bind(keyframe_id).Run();
}

std::vector<TileId> ReadSessionFootprint(Connection& connection, std::int64_t session_id) {
  Query row = connection.Prepare(
      "SELECT DISTINCT t.tile_key FROM keyframes k JOIN keyframe_tiles t ON t.keyframe_id = k.id "
      "WHERE k.session_id = ? AND t.is_current ORDER BY t.tile_key");
  row.Bind(session_id);
  return ReadKeys(row);
}

std::vector<TileId> ReadAllFootprints(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT DISTINCT tile_key FROM keyframe_tiles WHERE is_current ORDER BY tile_key");
  return ReadKeys(row);
}

void TouchSessionFootprint(Connection& connection,
                           std::int64_t session_id,
                           std::uint64_t revision) {
  connection
      .Prepare(
          "UPDATE keyframe_tiles SET revision = ? WHERE is_current AND keyframe_id IN "
          "(SELECT id FROM keyframes WHERE session_id = ?)")
      .Bind(revision)
      .Bind(session_id)
      .Run();
}

Status CheckFootprint(Connection& connection, std::int64_t keyframe_id, std::uint64_t revision) {
  Query row = connection.Prepare(
      "SELECT tile_key, revision FROM keyframe_tiles WHERE keyframe_id = ? AND "
      "(revision > ? OR revision < (CASE WHEN is_current THEN ? ELSE 1 END))");
  row.Bind(keyframe_id).Bind(revision).Bind(revision);
  if (!row.Step()) {
    return {};
  }
  row.Rewind();
  const std::uint64_t key = row.Unsigned();
  return Status(StatusCode::kInvalidData,
                StrCat("store: keyframe ", keyframe_id, " changed last at revision ", revision,
                       ", in the tile with the key ", key, " it says ", row.Unsigned()));
}

std::vector<FootprintRow> FootprintsSince(Connection& connection,
                                          const TileId& tile,
                                          std::uint64_t revision) {
  Query row = connection.Prepare(
      "SELECT keyframe_id, is_current FROM keyframe_tiles WHERE tile_key = ? AND revision > ? "
      "ORDER BY keyframe_id");
  row.Bind(tile.Key()).Bind(static_cast<std::int64_t>(revision) - (revision == 0 ? 1 : 0));
  std::vector<FootprintRow> rows;
  while (row.Step()) {
    row.Rewind();
    rows.push_back({row.Int(), row.Int() != 0});
  }
  return rows;
}

Result<std::vector<TileId>> ListFootprintRows(Connection& connection,
                                              std::uint8_t level,
                                              std::int64_t after_key,
                                              std::uint32_t limit) {
  std::int64_t after = -1;
  if (after_key >= 0) {
    const auto id = TileId::FromKey(static_cast<std::uint64_t>(after_key));
    if (!id) {
      return Error(id.error());
    }
    after = Level0Range(*id).last;
  }
  std::vector<TileId> tiles;
  while (tiles.size() < limit) {
    const auto next = NextTile(connection, after);
    if (!next) {
      return Error(next.error());
    }
    if (!*next) {
      break;
    }
    tiles.push_back(AncestorOf(**next, level));
    after = Level0Range(tiles.back()).last;
  }
  return tiles;
}

Status ScanFootprintRows(Connection& connection,
                         const TileRect& rect,
                         const std::function<void(const TileId&)>& visit) {
  for (const KeyRange& range : CoverRect(Level0Rect(rect), kMaxRanges)) {
    std::int64_t after = range.first - 1;
    while (after < range.last) {
      const auto next = NextTile(connection, after);
      if (!next) {
        return next.error();
      }
      if (!*next || static_cast<std::int64_t>((*next)->Key()) > range.last) {
        break;
      }
      const TileId tile = AncestorOf(**next, rect.level);
      if (rect.Contains(tile)) {
        visit(tile);
      }
      after = Level0Range(tile).last;
    }
  }
  return {};
}

}  // namespace atlas
