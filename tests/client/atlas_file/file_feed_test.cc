// The map around a vehicle from an atlas file, and what a store becomes by it.
#include "client/atlas_file/file_feed.h"

#include <filesystem>
#include <vector>

#include <gtest/gtest.h>

#include "client/vehicle/atlas_view.h"
#include "tests/client/atlas_file/tiny_atlas_file.h"

namespace atlas {
namespace {

constexpr double kSide_m = 1.6;  // of a level-0 tile
const Eigen::Vector2d kMiddle(4 * kSide_m, 4 * kSide_m);

class FileFeedTest : public testing::Test {
 protected:
  FileFeedTest() {
    for (int x = 0; x < 8; ++x) {
      for (int y = 0; y < 8; ++y) {
        world_.Set(x, y, 100 * x + y);
      }
    }
    written_.Write(world_);
  }
  AtlasFile Opened() const {
    auto opened = AtlasFile::Open(written_.path());
    if (!opened) throw std::runtime_error(opened.error().message());
    return *std::move(opened);
  }

  TinyWorld world_;
  TinyAtlasFile written_;
  TileStore store_ = *TileStore::Open(TinyAtlas(), {});
};

TEST_F(FileFeedTest, EverythingAroundIsFinestAndCurrent) {
  AtlasFile file = Opened();
  FileFeed feed(file);
  AtlasView view(store_, feed);
  const auto map = view.Around(kMiddle, 0.5);
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_TRUE(map->is_current) << map->sync.message();
  EXPECT_TRUE(map->is_finest_everywhere());
  EXPECT_EQ(map->tiles.size(), 4U);
  EXPECT_EQ(map->finest_places, 4U);
  EXPECT_EQ(map->revision, file.revision());
  const auto again = view.Around(kMiddle, 0.5);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->transfer.tiles, 0U);
  EXPECT_EQ(again->tiles, map->tiles);  // the same objects
}

TEST_F(FileFeedTest, CoarseLevelsAreReadAsSuch) {
  AtlasFile file = Opened();
  FileFeed feed(file);
  AroundOptions options;
  options.finest_level = 2;
  const auto map = AtlasView(store_, feed).Around(kMiddle, 5.0, options);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->tiles.size(), 4U);
  for (const auto& tile : map->tiles) {
    EXPECT_EQ(tile->id.level, 2);
  }
}

TEST_F(FileFeedTest, ASmallBudgetLeavesParentsAndTheNextCallsCompleteThem) {
  AtlasFile file = Opened();
  FileFeed feed(file);
  AtlasView view(store_, feed);
  AroundOptions options;
  options.budget_bytes = 6'000;
  for (int call = 0; call < 100; ++call) {
    const auto map = view.Around(kMiddle, 5.0, options);
    ASSERT_TRUE(map);
    ASSERT_TRUE(map->sync.ok()) << map->sync.message();
    EXPECT_LE(map->transfer.bytes, options.budget_bytes);
    EXPECT_EQ(map->is_current, map->coarse_places == 0) << map->coarse_places;
    if (map->is_current) {
      EXPECT_GT(call, 0);
      EXPECT_EQ(map->tiles.size(), map->finest_places);
      return;
    }
    ASSERT_FALSE(map->tiles.empty());
    EXPECT_GE(map->tiles.front()->id.level, map->tiles.back()->id.level);
  }
  FAIL();
}

TEST_F(FileFeedTest, WithoutTimeNothingComes) {
  AtlasFile file = Opened();
  FileFeed feed(file);
  AroundOptions options;
  options.deadline = std::chrono::milliseconds(0);
  const auto map = AtlasView(store_, feed).Around(kMiddle, 5.0, options);
  ASSERT_TRUE(map);
  EXPECT_TRUE(map->sync.ok());
  EXPECT_FALSE(map->is_current);
  EXPECT_TRUE(map->tiles.empty());
}

TEST_F(FileFeedTest, ALaterStateReplacesAndRemoves) {
  {
    AtlasFile file = Opened();
    FileFeed feed(file);
    ASSERT_TRUE(AtlasView(store_, feed).Around(kMiddle, 20.0)->is_current);
  }
  world_.Set(3, 3, -77);
  world_.Erase(4, 4);
  written_.Write(world_);
  AtlasFile file = Opened();
  FileFeed feed(file);
  const auto map = AtlasView(store_, feed).Around(kMiddle, 20.0);
  ASSERT_TRUE(map);
  EXPECT_TRUE(map->is_current);
  EXPECT_EQ(map->tiles.size(), 63U);
  ASSERT_EQ(store_.size(), world_.tiles().size());
  for (const auto& [id, stored] : world_.tiles()) {
    ASSERT_NE(store_.Find(id), nullptr) << id;
    EXPECT_EQ(store_.Find(id)->payload_hash, stored.encoded.payload_hash) << id;
  }
  EXPECT_LT(map->transfer.tiles, 12U);  // the changed ones and those above them
}

TEST_F(FileFeedTest, TilesOutsideOfTheAreaStay) {
  AtlasFile file = Opened();
  FileFeed feed(file);
  ASSERT_TRUE(feed.Sync(store_, BoxArea{{0.1, 0.1}, {1.0, 1.0}}, {}));
  const std::size_t held = store_.size();
  ASSERT_TRUE(feed.Sync(store_, BoxArea{{10.0, 10.0}, {11.0, 11.0}}, {}));
  EXPECT_GT(store_.size(), held);
  EXPECT_NE(store_.Find({0, 0, 0}), nullptr);
}

TEST_F(FileFeedTest, ARouteIsFetchedAhead) {
  AtlasFile file = Opened();
  FileFeed feed(file);
  const auto report =
      AtlasView(store_, feed).Prefetch({{0.8, 0.8}, {0.8, 8.8}}, 0.2, AroundOptions());
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->is_complete);
  for (int y = 0; y < 6; ++y) {
    EXPECT_NE(store_.Find({0, 0, y}), nullptr) << y;
  }
  EXPECT_EQ(store_.Find({0, 1, 0}), nullptr);
  EXPECT_EQ(store_.Find({0, 0, 6}), nullptr);
}

TEST_F(FileFeedTest, ADamagedTileIsNamedAndTheOthersCome) {
  written_.Damage({0, 3, 3});
  AtlasFile file = Opened();
  FileFeed feed(file);
  const auto map = AtlasView(store_, feed).Around(kMiddle, 0.5);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->sync.code(), StatusCode::kInvalidData);
  EXPECT_NE(map->sync.message().find("tile 0/3/3"), std::string::npos) << map->sync.message();
  EXPECT_FALSE(map->is_current);
  EXPECT_EQ(map->finest_places, 3U);
  EXPECT_EQ(map->coarse_places, 1U);
}

TEST_F(FileFeedTest, ATileThatIsListedAndNotThereIsDamage) {
  written_.DamageIndex({0, 3, 3});
  AtlasFile file = Opened();
  FileFeed feed(file);
  const auto map = AtlasView(store_, feed).Around(kMiddle, 0.5);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->sync.code(), StatusCode::kInvalidData) << map->sync.message();
  EXPECT_NE(map->sync.message().find("tile 0/3/3"), std::string::npos) << map->sync.message();
  EXPECT_FALSE(map->is_current);
  EXPECT_EQ(map->finest_places, 3U);
  EXPECT_EQ(map->coarse_places, 1U);
  const Status level = file.ReadLevel(0, std::nullopt, [](const TileBlob&) { return Status(); });
  EXPECT_EQ(level.code(), StatusCode::kInvalidData) << level.message();
}

// Links to themselves cannot be opened, also not by root.
TEST_F(FileFeedTest, HeldTilesWhoseFilesCannotBeReadComeAgain) {
  namespace fs = std::filesystem;
  const fs::path folder = written_.path().parent_path().parent_path() / "tiles";
  AtlasFile file = Opened();
  FileFeed feed(file);
  store_ = *TileStore::Open(TinyAtlas(), {.folder = folder});
  const auto all = AtlasView(store_, feed).Around(kMiddle, 20.0);
  ASSERT_TRUE(all && all->is_current);
  store_ = *TileStore::Open(TinyAtlas(), {});  // lets the folder go
  store_ = *TileStore::Open(TinyAtlas(), {.folder = folder});
  std::vector<fs::path> paths;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".tile") paths.push_back(entry.path());
  }
  for (const fs::path& path : paths) {
    fs::remove(path);
    fs::create_symlink(path.filename(), path);
  }
  AtlasView view(store_, feed);
  const auto none = view.Around(kMiddle, 20.0);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->disk.code(), StatusCode::kUnavailable);
  EXPECT_TRUE(none->tiles.empty());
  EXPECT_EQ(store_.size(), paths.size());
  const auto again = view.Around(kMiddle, 20.0);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->is_current) << again->disk.message();
  EXPECT_EQ(again->transfer.tiles, all->transfer.tiles);
}

TEST_F(FileFeedTest, AnotherAtlasIsAConflict) {
  AtlasFile file = Opened();
  FileFeed feed(file);
  TileStore other = *TileStore::Open({Bytes(16, 9), TinyProfile()}, {});
  EXPECT_EQ(feed.Sync(other, DiscArea{kMiddle, 1.0}, {}).error().code(), StatusCode::kConflict);
}

TEST_F(FileFeedTest, WhatAFileFilledADaemonNeedNotSend) {
  AtlasFile file = Opened();
  FileFeed feed(file);
  ASSERT_TRUE(AtlasView(store_, feed).Around(kMiddle, 20.0)->is_current);
  SyncPeer peer(world_);
  LinkOptions options;
  options.connection = peer.options();
  AtlasLink link(options);
  const auto map = AtlasView(store_, &link).Around(kMiddle, 20.0);
  ASSERT_TRUE(map);
  EXPECT_TRUE(map->is_current) << map->sync.message();
  EXPECT_EQ(peer.tiles_sent(), 0);
}

}  // namespace
}  // namespace atlas
