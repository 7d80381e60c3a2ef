// A small world (tests/client/vehicle/sync_peer.h) as a daemon's database.
#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>

#include <sqlite3.h>

#include "server/store/await.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/client/vehicle/sync_peer.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {

class TinyAtlasFile {
 public:
  TinyAtlasFile() {
    options_.directory = folder_.path() / "data";
    options_.new_profile = TinyProfile();
    const AtlasKey key = TinyAtlas();
    std::copy(key.atlas_id.begin(), key.atlas_id.end(), options_.new_atlas_id.begin());
    Open();
  }

  std::filesystem::path path() const { return options_.directory / "atlas.db"; }
  const std::filesystem::path& folder() const { return folder_.path(); }
  std::uint64_t revision() const { return store_->revision(); }

  // Marks every tile of the world, and those that the file has and the world has not.
  void Mark(const TinyWorld& world) {
    NewKeyframe keyframe;
    keyframe.key = {{"car", "day"}, ++sequence_};
    keyframe.time_ms = 1'000;
    keyframe.blob = {1, 2, static_cast<std::uint8_t>(sequence_)};
    for (const auto& [id, stored] : world.tiles()) {
      if (id.level == 0) keyframe.footprint.push_back(id);
    }
    const Status scanned = store_->ScanTiles({0}, [&](const TileSummary& tile) {
      if (!world.tiles().contains(tile.id)) keyframe.footprint.push_back(tile.id);
    });
    const auto put = Await<PutKeyframeResult>(
        [&](auto done) { store_->PutKeyframe(keyframe, std::move(done)); });
    if (!scanned.ok() || !put) throw std::runtime_error("put");
  }
  // The file's tiles become the world's.
  void Write(const TinyWorld& world) {
    Mark(world);
    while (true) {
      const auto claimed = Await<ClaimResult>([&](auto done) {
        store_->ClaimDirty({"worker", 1'000, 60'000, 100, ~std::uint64_t{0} >> 1U},
                           std::move(done));
      });
      if (!claimed) throw std::runtime_error(claimed.error().message());
      if (claimed->claims.empty()) return;
      for (const TileClaim& claim : claimed->claims) {
        Finish(claim, world);
      }
    }
  }
  void Close() { store_.reset(); }
  void Open() {
    auto store = OpenSqliteStore(options_);
    if (!store) throw std::runtime_error(store.error().message());
    store_ = *std::move(store);
  }
  // Closes it and damages the stored blob.
  void Damage(const TileId& id) {
    Close();
    Execute("UPDATE tiles SET blob = zeroblob(9) WHERE key = " + std::to_string(id.Key()));
  }
  // Closes it and takes the tile out of its table, but not out of the index that lists tiles: who
  // does not know that the index is there leaves it as it is.
  void DamageIndex(const TileId& id) {
    Close();
    const std::string of_index = " WHERE name = 'tile_summaries'";
    Execute("PRAGMA writable_schema = ON; CREATE TABLE hidden AS SELECT * FROM sqlite_schema" +
            of_index + "; DELETE FROM sqlite_schema" + of_index);
    Execute("DELETE FROM tiles WHERE key = " + std::to_string(id.Key()));
    Execute("PRAGMA writable_schema = ON; INSERT INTO sqlite_schema SELECT * FROM hidden");
    Execute("DROP TABLE hidden");
  }

 private:
  // On a connection of its own, which reads the schema anew.
  void Execute(const std::string& sql) {
    sqlite3* db = nullptr;
    const bool is_done = sqlite3_open(path().c_str(), &db) == SQLITE_OK &&
                         sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
    const std::string error = is_done ? "" : sqlite3_errmsg(db);
    sqlite3_close(db);
    if (!is_done) throw std::runtime_error(sql + ": " + error);
  }
  void Finish(const TileClaim& claim, const TinyWorld& world) {
    FinishedTile tile{claim, claim.generation, std::nullopt};
    const auto found = world.tiles().find(claim.id);
    if (found != world.tiles().end()) {
      tile.content = {found->second.encoded.blob, found->second.encoded.payload_hash, 1, 0};
    }
    const auto done =
        Await<FinishResult>([&](auto finish) { store_->FinishTile(tile, std::move(finish)); });
    if (!done) throw std::runtime_error(done.error().message());
  }

  TestFolder folder_;
  SqliteStoreOptions options_;
  std::unique_ptr<AtlasStore> store_;
  std::uint32_t sequence_ = 0;
};

}  // namespace atlas
