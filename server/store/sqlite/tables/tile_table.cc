#include "server/store/sqlite/tables/tile_table.h"

#include <limits>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/tile_block.h"
#include "server/store/tile_ranges.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxRanges = 64;
constexpr std::int64_t kPage = 1'024;
constexpr std::int64_t kNoLimit = -1;
constexpr std::int64_t kLastKey = std::numeric_limits<std::int64_t>::max();

struct TileRow {
  std::uint64_t key = 0;
  std::uint64_t revision = 0;
  std::uint64_t fused_revision = 0;
  std::uint64_t payload_hash = 0;
  std::uint32_t cells = 0;
  std::uint32_t multilayer_cells = 0;
  std::uint32_t blob_bytes = 0;
  std::uint64_t blob_hash = 0;
  bool is_vouched = true;  // by its checksum
  Bytes blob;

  std::int64_t ExpectedChecksum() const {
    return RowHash(RowKind::kTile)
        .Unsigned(key)
        .Unsigned(revision)
        .Unsigned(fused_revision)
        .Unsigned(payload_hash)
        .Unsigned(cells)
        .Unsigned(multilayer_cells)
        .Unsigned(blob_bytes)
        .Unsigned(blob_hash)
        .value();
  }
  bool is_intact() const {
    return is_vouched && blob.size() == blob_bytes && Hash64(blob) == blob_hash;
  }
};

// Everything but the blob.
void ReadNumbers(Query& query, TileRow& row) {
  row.revision = query.Unsigned();
  row.fused_revision = query.Unsigned();
  row.payload_hash = query.Unsigned();
  row.cells = query.Unsigned32();
  row.multilayer_cells = query.Unsigned32();
  row.blob_bytes = query.Unsigned32();
  row.blob_hash = query.Unsigned();
  row.is_vouched = query.IsChecksum(row.ExpectedChecksum());
}

// The rows of a range of keys by the index, which is small, and by the table.
constexpr const char* kByIndex =
    "SELECT key, revision, fused_revision, payload_hash, cells, multilayer_cells, blob_bytes, "
    "blob_hash, checksum FROM tiles INDEXED BY tile_summaries "
    "WHERE key BETWEEN ? AND ? ORDER BY key LIMIT ?";
constexpr const char* kByTable =
    "SELECT key, revision, fused_revision, payload_hash, cells, multilayer_cells, blob_bytes, "
    "blob_hash, checksum FROM tiles NOT INDEXED WHERE key BETWEEN ? AND ? ORDER BY key LIMIT ?";

std::optional<TileRow> ReadRow(Connection& connection, const TileId& id) {
  Query query = connection.Prepare(
      "SELECT shard, revision, fused_revision, payload_hash, cells, multilayer_cells, blob_bytes, "
      "blob_hash, checksum, blob FROM tiles WHERE key = ?");
  query.Bind(id.Key());
  if (!query.Step()) {
    return std::nullopt;
  }
  TileRow row;
  row.key = id.Key();
  const bool is_in_shard = query.Int() == ShardOf(id);  // follows from the key: in no checksum
  ReadNumbers(query, row);
  row.is_vouched = row.is_vouched && is_in_shard;
  row.blob = query.Blob();
  return row;
}

bool IsFound(Connection& connection, const TileId& id) {
  Query query = connection.Prepare("SELECT 1 FROM tiles NOT INDEXED WHERE key = ?");
  query.Bind(id.Key());
  return query.Step();
}

// What the index says of a tile; nullopt: nothing, or it is damaged and is not believed.
std::optional<TileRow> ReadListed(Connection& connection, const TileId& id) {
  Query query = connection.Prepare(kByIndex);
  query.Bind(id.Key()).Bind(id.Key()).Bind(kNoLimit);
  if (!query.Step()) {
    return std::nullopt;
  }
  TileRow row;
  row.key = query.Unsigned();
  ReadNumbers(query, row);
  return row.is_vouched ? std::optional(row) : std::nullopt;
}

// Adds (sign 1) or takes away (sign -1) what the row counts for.
void Count(Connection& connection, const TileId& id, const TileRow& row, int sign) {
  AddToCounter(connection, Counter::kTiles, sign);
  AddToCounter(connection, Counter::kTileBytes, std::int64_t{row.blob_bytes} * sign);
  if (id.level == 0) {
    AddToCounter(connection, Counter::kCells, std::int64_t{row.cells} * sign);
    AddToCounter(connection, Counter::kMultilayerCells, std::int64_t{row.multilayer_cells} * sign);
  }
}

void InsertRow(Connection& connection, const TileId& id, const TileRow& row) {
  connection
      .Prepare(
          "INSERT INTO tiles (key, shard, revision, fused_revision, payload_hash, cells, "
          "multilayer_cells, blob_bytes, blob_hash, checksum, blob) "
          "VALUES (?,?,?,?,?,?,?,?,?,?,?)")
      .Bind(row.key)
      .Bind(ShardOf(id))
      .Bind(row.revision)
      .Bind(row.fused_revision)
      .Bind(row.payload_hash)
      .Bind(row.cells)
      .Bind(row.multilayer_cells)
      .Bind(row.blob_bytes)
      .Bind(row.blob_hash)
      .Bind(row.ExpectedChecksum())
      .Bind(ByteSpan(row.blob))
      .Run();
}

void DeleteRow(Connection& connection, const TileId& id) {
  connection.Prepare("DELETE FROM tiles WHERE key = ?").Bind(id.Key()).Run();
}

// A row that is not found while the index lists it is put back, without its blob: it is damaged
// then as others are, and goes with its line in the index.
std::optional<TileRow> PutBackLost(Connection& connection, const TileId& id) {
  const std::optional<TileRow> row = ReadListed(connection, id);
  if (row) {
    WithoutCounting(connection, RowKind::kTile, [&] { InsertRow(connection, id, *row); });
  }
  return row;
}

// After a damaged row went, whose numbers nobody can take away from the counters.
void Recount(Connection& connection) {
  const auto recount = [&connection](Counter counter, const char* sql) {
    SetCounter(connection, counter, static_cast<std::uint64_t>(connection.Ask(sql)));
  };
  recount(Counter::kTiles, "SELECT count(*) FROM tiles");
  recount(Counter::kTileBytes, "SELECT coalesce(sum(blob_bytes), 0) FROM tiles");
  recount(Counter::kCells, "SELECT coalesce(sum(cells), 0) FROM tiles WHERE key < 1 << 58");
  recount(Counter::kMultilayerCells,
          "SELECT coalesce(sum(multilayer_cells), 0) FROM tiles WHERE key < 1 << 58");
}

TileRow NewRow(const TileId& id, const TileContent& content) {
  TileRow row;
  row.key = id.Key();
  row.payload_hash = content.payload_hash;
  row.cells = content.cells;
  row.multilayer_cells = content.multilayer_cells;
  row.blob_bytes = static_cast<std::uint32_t>(content.blob.size());
  row.blob_hash = Hash64(content.blob);
  row.blob = content.blob;
  return row;
}

enum class Damaged { kFails, kIsListed };

// A key that no tile has is left out; what else is damaged fails when it is read. False: it met
// damage that it was to fail for.
bool AddSummaries(Query& query, Damaged damaged, std::vector<TileSummary>& tiles) {
  while (query.Step()) {
    query.Rewind();
    TileRow row;
    row.key = query.Unsigned();
    ReadNumbers(query, row);
    if (damaged == Damaged::kFails && !row.is_vouched) {
      return false;
    }
    if (const auto id = TileId::FromKey(row.key)) {
      tiles.push_back({*id, row.revision, row.payload_hash, row.blob_bytes});
    }
  }
  return true;
}

// By the table where the index is damaged: a tile that it does not show must not count as gone.
std::vector<TileSummary> ReadRange(Connection& connection,
                                   std::int64_t first,
                                   std::int64_t last,
                                   std::int64_t limit) {
  std::vector<TileSummary> tiles;
  Query by_index = connection.Prepare(kByIndex);
  by_index.Bind(first).Bind(last).Bind(limit);
  if (!AddSummaries(by_index, Damaged::kFails, tiles)) {
    tiles.clear();
    Query by_table = connection.Prepare(kByTable);
    by_table.Bind(first).Bind(last).Bind(limit);
    AddSummaries(by_table, Damaged::kIsListed, tiles);
  }
  return tiles;
}

}  // namespace

Result<std::optional<StoredTile>> ReadTileRow(Connection& connection, const TileId& id) {
  std::optional<TileRow> row = ReadRow(connection, id);
  if (!row && ReadListed(connection, id)) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: tile ", id, " is damaged: it is listed, and its row is not found"));
  }
  if (!row) {
    return std::nullopt;
  }
  if (!row->is_intact()) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: tile ", id, " is damaged: wrong checksum"));
  }
  return StoredTile{id, row->revision, row->payload_hash, std::move(row->blob)};
}

bool StoreTile(Connection& connection,
               const TileId& id,
               const std::optional<TileContent>& content,
               std::uint64_t fused_revision) {
  std::optional<TileRow> old = ReadRow(connection, id);
  if (!old) {
    old = PutBackLost(connection, id);
  }
  if (!old && !content) {
    return false;
  }
  const bool is_damaged = old && !old->is_intact();
  if (old && content && !is_damaged && old->payload_hash == content->payload_hash) {
    return false;
  }
  if (old) {
    Count(connection, id, *old, -1);
    DeleteRow(connection, id);
  }
  const std::uint64_t revision = NextRevision(connection);
  if (content) {
    TileRow row = NewRow(id, *content);
    row.revision = revision;
    row.fused_revision = fused_revision;
    InsertRow(connection, id, row);
    Count(connection, id, row, 1);
  }
  if (is_damaged) {
    Recount(connection);
  }
  return true;
}

std::uint32_t PutBackLostTiles(Connection& connection) {
  std::uint32_t put_back = 0;
  for (const TileSummary& tile : ReadRange(connection, 0, kLastKey, kNoLimit)) {
    if (!IsFound(connection, tile.id)) {
      put_back += PutBackLost(connection, tile.id) ? 1U : 0U;
    }
  }
  return put_back;
}

std::uint32_t RestoreTileRows(Connection& connection) {
  std::vector<TileRow> told;
  {
    Query query = connection.Prepare(kByTable);
    query.Bind(std::numeric_limits<std::int64_t>::min()).Bind(kLastKey).Bind(kNoLimit);
    while (query.Step()) {
      query.Rewind();
      TileRow row;
      row.key = query.Unsigned();
      ReadNumbers(query, row);
      const auto id = TileId::FromKey(row.key);
      if (row.is_vouched || !id) {
        continue;
      }
      if (auto listed = ReadListed(connection, *id)) {
        told.push_back(*std::move(listed));
      }
    }
  }
  WithoutCounting(connection, RowKind::kTile, [&] {
    for (const TileRow& row : told) {
      connection
          .Prepare(
              "UPDATE tiles SET revision = ?, fused_revision = ?, payload_hash = ?, cells = ?, "
              "multilayer_cells = ?, blob_bytes = ?, blob_hash = ?, checksum = ? WHERE key = ?")
          .Bind(row.revision)
          .Bind(row.fused_revision)
          .Bind(row.payload_hash)
          .Bind(row.cells)
          .Bind(row.multilayer_cells)
          .Bind(row.blob_bytes)
          .Bind(row.blob_hash)
          .Bind(row.ExpectedChecksum())
          .Bind(row.key)
          .Run();
    }
  });
  return static_cast<std::uint32_t>(told.size());
}

void ScanTileRows(Connection& connection,
                  const TileRect& rect,
                  const std::function<void(const TileSummary&)>& visit) {
  for (const KeyRange& range : CoverRect(rect, kMaxRanges)) {
    std::int64_t first = range.first;
    while (true) {
      const auto page = ReadRange(connection, first, range.last, kPage);
      if (page.empty()) {
        break;
      }
      for (const TileSummary& tile : page) {
        if (rect.Contains(tile.id)) {
          visit(tile);
        }
      }
      first = static_cast<std::int64_t>(page.back().id.Key()) + 1;
    }
  }
}

std::vector<TileSummary> ReadTileBlockRows(Connection& connection, std::uint64_t block) {
  const auto first = static_cast<std::int64_t>(FirstKeyOf(block));
  const auto last = static_cast<std::int64_t>(FirstKeyOf(block + 1) - 1);
  return ReadRange(connection, first, last, kNoLimit);
}

std::vector<TileSummary> ListTileRows(Connection& connection,
                                      std::int64_t after_key,
                                      std::uint32_t limit) {
  return ReadRange(connection, after_key + 1, kLastKey, limit);
}

}  // namespace atlas
