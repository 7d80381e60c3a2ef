// A store with a little of everything, its backups, and what is in a database file.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/base/hash.h"
#include "server/store/backup_types.h"
#include "server/store/sqlite/restore.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {

class BackupTest : public StoreTest {
 protected:
  BackupTest() { std::filesystem::create_directories(folder()); }

  std::filesystem::path folder() const { return directory_ / "backups"; }
  std::filesystem::path backup() const { return folder() / "monday"; }
  // Beside the atlas that was backed up.
  std::filesystem::path restored() const { return directory_ / "restored" / "atlas.db"; }

  // Tiles of these tests are their own payloads.
  static BackupWork Work() {
    BackupWork work;
    work.payload_of = [](ByteSpan blob) {
      return Result<Bytes>(Bytes(blob.begin(), blob.end()));
    };
    return work;
  }
  static TileContent Tile(std::uint8_t value) {
    TileContent content{Bytes(200, value), 0, 10, value};
    content.payload_hash = Hash64(content.blob);
    return content;
  }
  static NewKeyframe Keyframe(std::uint32_t sequence, std::size_t blob_bytes = 300) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {{0, 0, 0}, {0, 1, 0}});
    keyframe.blob.resize(blob_bytes, static_cast<std::uint8_t>(sequence));
    return keyframe;
  }

  // Keyframes 1 to `count`, corrected poses, fused tiles, marks, a session's history.
  void Fill(std::uint32_t count, std::size_t blob_bytes = 300) {
    Open();
    for (std::uint32_t sequence = 1; sequence <= count; ++sequence) {
      ASSERT_TRUE(Put(Keyframe(sequence, blob_bytes)).has_value());
    }
    ASSERT_TRUE(
        Update({{{{"bus", "day"}, 1}, PoseAt(5'000'000), {{0, 1, 0}, {0, 2, 0}}}}).has_value());
    std::uint8_t value = 1;
    for (const TileClaim& claim : Claim().claims) {
      ASSERT_TRUE(Finish(claim, Tile(value++)).has_value());
    }
    for (const SessionAction action : {SessionAction::kRetract, SessionAction::kRestore}) {
      ASSERT_TRUE(Await<SessionChangeResult>([&](auto done) {
                    store_->ChangeSession({{"bus", "day"}, action, "tester", ""}, std::move(done));
                  }).has_value());
    }
  }

  Result<AtlasFacts> WriteBackup() { return store_->WriteBackup(backup(), Work()); }
  Result<RestoredAtlas> Restore(bool replaces = false) {
    return RestoreAtlas({backup(), restored(), replaces, Work()});
  }
  // The store in the folder of `restored()`, instead of the one that is open.
  void OpenRestored() {
    store_.reset();
    options_.directory = restored().parent_path();
    Open();
  }

  static std::vector<std::string> NamesIn(const std::filesystem::path& directory) {
    std::vector<std::string> names;
    if (std::filesystem::exists(directory)) {
      for (const auto& entry : std::filesystem::directory_iterator(directory)) {
        names.push_back(entry.path().filename().string());
      }
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  // Every row of what a restore leaves as it is, by table. Nobody has the database open.
  static std::map<std::string, std::string> RowsOf(const std::filesystem::path& database) {
    constexpr std::array kTables = {"sessions",       "keyframes",    "poses",
                                    "pose_history",   "pose_batches", "tiles",
                                    "keyframe_tiles", "dirty_tiles",  "session_states",
                                    "compactions",    "tombstones",   "damaged_keyframes"};
    std::map<std::string, std::string> rows;
    sqlite3* db = nullptr;
    const std::string uri = "file:" + database.string() + "?immutable=1";  // nothing beside it
    EXPECT_EQ(sqlite3_open_v2(uri.c_str(), &db, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr),
              SQLITE_OK);
    for (const char* table : kTables) {
      const auto add = [](void* text, int columns, char** values, char** /*names*/) {
        for (int i = 0; i < columns; ++i) {
          *static_cast<std::string*>(text) += std::string(values[i] ? values[i] : "null") + "|";
        }
        return 0;
      };
      // Blobs as text that has no end in it.
      const std::string sql =
          std::string("SELECT *") +
          (table == std::string("keyframes") || table == std::string("tiles") ? ", hex(blob)"
                                                                              : "") +
          " FROM " + table;
      EXPECT_EQ(sqlite3_exec(db, sql.c_str(), add, &rows[table], nullptr), SQLITE_OK) << table;
    }
    sqlite3_close(db);
    return rows;
  }
};

}  // namespace atlas
