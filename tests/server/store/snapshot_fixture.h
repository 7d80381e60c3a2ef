// Atlas files, those that they are copied to, and somebody who may not write to them.
#pragma once

#include <fstream>
#include <iterator>
#include <map>

#include "server/store/sqlite/store_snapshot.h"
#include "tests/server/store/as_nobody.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {

namespace fs = std::filesystem;

// Everything in a folder: what a reader must leave as it is.
struct FolderState {
  struct File {
    std::string bytes;
    fs::file_time_type written;
    friend bool operator==(const File&, const File&) = default;
  };
  std::map<std::string, File> files;

  static FolderState Of(const fs::path& folder) {
    FolderState state;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().string().ends_with("-shm")) {
        continue;  // SQLite's index of a log, its to keep
      }
      std::ifstream in(entry.path(), std::ios::binary);
      state.files[entry.path().filename()] = {std::string(std::istreambuf_iterator<char>(in), {}),
                                              entry.last_write_time()};
    }
    return state;
  }
  friend bool operator==(const FolderState&, const FolderState&) = default;
};

class SnapshotTest : public StoreTest {
 protected:
  // Stores this in every tile that is dirty.
  void Fuse(std::uint8_t value) {
    while (true) {
      const ClaimResult claimed = Claim();
      if (claimed.claims.empty()) return;
      for (const TileClaim& claim : claimed.claims) {
        ASSERT_TRUE(Finish(claim, Content(value)));
      }
    }
  }
  void Fill() {
    Open();
    ASSERT_TRUE(Put(MakeKeyframe(1, {{0, 3, -4}, {0, 4, -4}})));
    Fuse(9);
  }
  static Result<StoreSnapshot> OpenFile(const fs::path& file) { return StoreSnapshot::Open(file); }
  static StatusCode CodeOf(const fs::path& file) {
    const auto snapshot = StoreSnapshot::Open(file);
    return snapshot ? StatusCode::kOk : snapshot.error().code();
  }
  static std::vector<TileId> Level0(StoreSnapshot& snapshot) {
    std::vector<TileId> ids;
    const Status status = snapshot.ScanTiles({0}, [&](const TileSummary& tile) {
      ids.push_back(tile.id);
      return Status();
    });
    EXPECT_TRUE(status.ok()) << status.message();
    return ids;
  }
  static std::uint8_t ValueOf(StoreSnapshot& snapshot, const TileId& id) {
    const auto tile = snapshot.ReadTile(id);
    EXPECT_TRUE(tile) << tile.error().message();
    return tile && *tile ? (*tile)->blob.at(0) : 0;
  }
  // A folder of its own with copies of the database and, if there is one, its log.
  fs::path CopyTo(const std::string& name) const {
    const fs::path folder = directory_ / name;
    fs::create_directory(folder);
    for (const char* file : {"atlas.db", "atlas.db-wal"}) {
      if (fs::exists(options_.directory / file)) {
        fs::copy(options_.directory / file, folder / file);
      }
    }
    return folder / "atlas.db";
  }
  // Nobody may write to the folder or to what is in it, and everybody may read.
  void Protect(const fs::path& folder) const {
    fs::permissions(directory_, fs::perms(0755));
    for (const auto& entry : fs::directory_iterator(folder)) {
      fs::permissions(entry.path(), fs::perms(0444));
    }
    fs::permissions(folder, fs::perms(0555));
  }
};

}  // namespace atlas
