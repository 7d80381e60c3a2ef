#include "server/store/sqlite/tables/footprint_table.h"

#include <algorithm>
#include <optional>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/tile_ranges.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxRanges = 64;

// A statement a row is a fifth slower than one for eight.
constexpr std::size_t kRowsAtOnce = 8;
constexpr const char* kAddOne =
    "INSERT INTO keyframe_tiles (tile_key, keyframe_id, revision, is_current, checksum) "
    "VALUES (?,?,?,1,?) "
    "ON CONFLICT DO UPDATE SET revision = excluded.revision, is_current = 1, "
    "checksum = excluded.checksum";
constexpr const char* kAddEight =
    "INSERT INTO keyframe_tiles (tile_key, keyframe_id, revision, is_current, checksum) "
    "VALUES (?,?,?,1,?),(?,?,?,1,?),(?,?,?,1,?),(?,?,?,1,?),"
    "(?,?,?,1,?),(?,?,?,1,?),(?,?,?,1,?),(?,?,?,1,?) "
    "ON CONFLICT DO UPDATE SET revision = excluded.revision, is_current = 1, "
    "checksum = excluded.checksum";

struct Row {
  std::uint64_t tile_key = 0;
  std::int64_t keyframe_id = 0;
  std::uint64_t revision = 0;
  bool is_current = true;

  std::int64_t Checksum() const {
    return RowHash(RowKind::kFootprint)
        .Unsigned(tile_key)
        .Int(keyframe_id)
        .Unsigned(revision)
        .Int(is_current ? 1 : 0)
        .value();
  }
};

// Columns: tile_key, keyframe_id, revision, is_current, checksum. Nothing: it is damaged, and of
// `row` only the key is to be believed.
bool ReadIntactRow(Query& query, Row& row) {
  query.Rewind();
  row.tile_key = query.Unsigned();
  row.keyframe_id = query.Int();
  row.revision = query.Unsigned();
  row.is_current = query.Bool();
  return query.IsChecksum(row.Checksum());
}

// Throws where it is damaged.
Row ReadRow(Query& query) {
  Row row;
  if (!ReadIntactRow(query, row)) {
    ThrowDamaged(StrCat("the footprint of keyframe ", row.keyframe_id, " in the tile with the key ",
                        row.tile_key, " is damaged: wrong checksum"));
  }
  return row;
}

TileId TileOf(const Row& row) {
  const auto id = TileId::FromKey(row.tile_key);
  if (!id || id->level != 0) {
    ThrowDamaged(StrCat("the footprint of keyframe ", row.keyframe_id, " names no tile"));
  }
  return *id;
}

// In key order, each once.
std::vector<TileId> ReadTiles(Query& query) {
  std::vector<TileId> tiles;
  while (query.Step()) {
    tiles.push_back(TileOf(ReadRow(query)));
  }
  std::sort(tiles.begin(), tiles.end(),
            [](const TileId& a, const TileId& b) { return a.Key() < b.Key(); });
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
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
    insert.Bind(Row{tile.Key(), keyframe_id, revision}.Checksum());
  }
  insert.Run();
}

}  // namespace

std::vector<TileId> ReadFootprint(Connection& connection, std::int64_t keyframe_id) {
  Query row = connection.Prepare(
      "SELECT tile_key, keyframe_id, revision, is_current, checksum FROM keyframe_tiles "
      "WHERE keyframe_id = ? AND is_current");
  row.Bind(keyframe_id);
  return ReadTiles(row);
}

void WriteFootprint(Connection& connection,
                    std::int64_t keyframe_id,
                    std::span<const TileId> footprint,
                    std::uint64_t revision) {
  connection
      .Prepare(
          "UPDATE keyframe_tiles SET is_current = 0, revision = ?1, "
          "checksum = row_hash(13, tile_key, keyframe_id, ?1, 0) "
          "WHERE keyframe_id = ?2 AND is_current")
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

std::vector<TileId> ReadFootprintUnchecked(Connection& connection, std::int64_t keyframe_id) {
  Query row = connection.Prepare("SELECT tile_key FROM keyframe_tiles WHERE keyframe_id = ?");
  row.Bind(keyframe_id);
  std::vector<TileId> tiles;
  while (row.Step()) {
    row.Rewind();
    if (const auto id = TileId::FromKey(row.Unsigned()); id && id->level == 0) {
      tiles.push_back(*id);
    }
  }
  return tiles;
}

std::vector<std::int64_t> ListKeyframesOfTile(Connection& connection, const TileId& tile) {
  Query row = connection.Prepare("SELECT keyframe_id FROM keyframe_tiles WHERE tile_key = ?");
  row.Bind(tile.Key());
  std::vector<std::int64_t> ids;
  while (row.Step()) {
    row.Rewind();
    ids.push_back(row.Int());
  }
  return ids;
}

void RestoreFootprint(Connection& connection,
                      std::int64_t keyframe_id,
                      std::span<const TileId> footprint,
                      std::uint64_t revision) {
  std::vector<Row> kept;  // of earlier poses
  {
    Query query = connection.Prepare(
        "SELECT tile_key, keyframe_id, revision, is_current, checksum FROM keyframe_tiles "
        "WHERE keyframe_id = ?");
    query.Bind(keyframe_id);
    Row row;
    while (query.Step()) {
      if (ReadIntactRow(query, row) && !row.is_current) {
        kept.push_back(row);
      }
    }
  }
  DeleteFootprint(connection, keyframe_id);
  WriteFootprint(connection, keyframe_id, footprint, revision);
  for (const Row& row : kept) {
    connection
        .Prepare(
            "INSERT OR IGNORE INTO keyframe_tiles (tile_key, keyframe_id, revision, is_current, "
            "checksum) VALUES (?,?,?,0,?)")
        .Bind(row.tile_key)
        .Bind(row.keyframe_id)
        .Bind(row.revision)
        .Bind(row.Checksum())
        .Run();
  }
}

void DeleteFootprint(Connection& connection, std::int64_t keyframe_id) {
  connection.Prepare("DELETE FROM keyframe_tiles WHERE keyframe_id = ?").Bind(keyframe_id).Run();
}

std::vector<TileId> ReadSessionFootprint(Connection& connection, std::int64_t session_id) {
  Query row = connection.Prepare(
      "SELECT t.tile_key, t.keyframe_id, t.revision, t.is_current, t.checksum FROM keyframes k "
      "JOIN keyframe_tiles t ON t.keyframe_id = k.id WHERE k.session_id = ? AND t.is_current");
  row.Bind(session_id);
  return ReadTiles(row);
}

std::vector<TileId> ReadAllFootprints(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT DISTINCT tile_key FROM keyframe_tiles WHERE is_current ORDER BY tile_key");
  std::vector<TileId> tiles;
  while (row.Step()) {
    row.Rewind();
    if (const auto id = TileId::FromKey(row.Unsigned())) {
      tiles.push_back(*id);
    }
  }
  return tiles;
}

void TouchSessionFootprint(Connection& connection,
                           std::int64_t session_id,
                           std::uint64_t revision) {
  connection
      .Prepare(
          "UPDATE keyframe_tiles SET revision = ?1, "
          "checksum = row_hash(13, tile_key, keyframe_id, ?1, 1) WHERE is_current "
          "AND keyframe_id IN (SELECT id FROM keyframes WHERE session_id = ?2)")
      .Bind(revision)
      .Bind(session_id)
      .Run();
}

Status CheckFootprint(Connection& connection, std::int64_t keyframe_id, std::uint64_t revision) {
  Query query = connection.Prepare(
      "SELECT tile_key, keyframe_id, revision, is_current, checksum FROM keyframe_tiles "
      "WHERE keyframe_id = ?");
  query.Bind(keyframe_id);
  while (query.Step()) {
    const Row row = ReadRow(query);
    if (row.revision > revision || row.revision < (row.is_current ? revision : 1)) {
      return Status(StatusCode::kInvalidData,
                    StrCat("store: keyframe ", keyframe_id, " changed last at revision ", revision,
                           ", in the tile with the key ", row.tile_key, " it says ", row.revision));
    }
  }
  return {};
}

std::vector<FootprintRow> FootprintsSince(Connection& connection,
                                          const TileId& tile,
                                          std::uint64_t revision) {
  Query row = connection.Prepare(
      "SELECT tile_key, keyframe_id, revision, is_current, checksum FROM keyframe_tiles "
      "WHERE tile_key = ? AND revision > ? ORDER BY keyframe_id");
  row.Bind(tile.Key()).Bind(static_cast<std::int64_t>(revision) - (revision == 0 ? 1 : 0));
  std::vector<FootprintRow> rows;
  while (row.Step()) {
    const Row stored = ReadRow(row);
    rows.push_back({stored.keyframe_id, stored.is_current});
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
