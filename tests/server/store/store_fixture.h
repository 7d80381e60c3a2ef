// A store in a directory of its own, and short ways to write to it.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "server/store/atlas_store.h"
#include "server/store/await.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/core/support/memory_folder.h"

namespace atlas {

class StoreTest : public ::testing::Test {
 protected:
  StoreTest() {
    directory_ = testing::NewMemoryFolder("atlas_store");
    options_.directory = directory_ / "data";
    options_.new_profile = MapProfile();
    options_.new_atlas_id = {1, 2, 3};
  }
  ~StoreTest() override {
    store_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(directory_, ignored);
  }

  void Open() {
    store_.reset();
    auto store = OpenSqliteStore(options_);
    ASSERT_TRUE(store.has_value()) << store.error().message();
    store_ = std::move(*store);
  }
  StatusCode OpenCode() {
    const auto store = OpenSqliteStore(options_);
    return store ? StatusCode::kOk : store.error().code();
  }

  static NewKeyframe MakeKeyframe(std::uint32_t sequence, std::vector<TileId> footprint) {
    NewKeyframe keyframe;
    keyframe.key = {{"bus", "day"}, sequence};
    keyframe.time_ms = 1000 + sequence;
    keyframe.level_quaternion = {1 << 30, 0, 0, 0};
    keyframe.blob = {7, 7, static_cast<std::uint8_t>(sequence)};
    keyframe.footprint = std::move(footprint);
    return keyframe;
  }
  static QuantizedPose PoseAt(std::int64_t x_um) {
    QuantizedPose pose;
    pose.x_um = x_um;
    return pose;
  }

  Result<PutKeyframeResult> Put(NewKeyframe keyframe) {
    return Await<PutKeyframeResult>(
        [&](auto done) { store_->PutKeyframe(std::move(keyframe), std::move(done)); });
  }
  Result<PoseBatchResult> Update(std::vector<NewPose> poses) {
    return Await<PoseBatchResult>([&](auto done) {
      store_->UpdatePoses({std::move(poses), "tester", 0}, std::move(done));
    });
  }
  ClaimResult Claim(std::uint64_t wave = 1u << 30,
                    std::string owner = "w",
                    std::int64_t now_ms = 1000) {
    return Await<ClaimResult>([&](auto done) {
             store_->ClaimDirty({std::move(owner), now_ms, 60'000, 100, wave}, std::move(done));
           })
        .value();
  }
  Result<FinishResult> Finish(const TileClaim& claim, std::optional<TileContent> content) {
    return Await<FinishResult>([&](auto done) {
      store_->FinishTile({claim, 1, std::move(content)}, std::move(done));
    });
  }
  static TileContent Content(std::uint8_t value) {
    return {Bytes{value, 1, 2, 3}, value, 10, value};
  }
  // All of both kinds; how much was not as it should be.
  std::uint32_t Repair() {
    std::uint32_t repaired = 0;
    for (const TableRepair what : {TableRepair::kRows, TableRepair::kSums}) {
      const auto result = Await<std::uint32_t>(
          [&](auto done) { store_->RepairTables(what, "tester", std::move(done)); });
      EXPECT_TRUE(result) << result.error().message();
      repaired += result.value_or(0U);
    }
    return repaired;
  }
  DirtyState Dirty() { return store_->ReadDirtyState().value(); }
  std::filesystem::path Database() const { return options_.directory / "atlas.db"; }
  // Closes the store and runs SQL on its database.
  void Tamper(const std::string& sql) {
    store_.reset();
    TamperBeside(sql);
  }
  // The same beside the store, which meets it with its next statement.
  void TamperBeside(const std::string& sql) const {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(Database().c_str(), &db), SQLITE_OK);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }

  std::filesystem::path directory_;
  SqliteStoreOptions options_;
  std::unique_ptr<AtlasStore> store_;
};

}  // namespace atlas
