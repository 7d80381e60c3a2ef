// What a store holds in bytes, and what goes where memory and disk differ.
#include <gtest/gtest.h>

#include "client/vehicle/tile_store.h"
#include "tests/client/vehicle/dense_tile.h"
#include "tests/client/vehicle/sync_peer.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

Status Put(TileStore& store, const TinyWorld& world, const TileId& id) {
  const TinyWorld::Stored& stored = world.tiles().at(id);
  return store.Put({id, stored.revision, stored.encoded.payload_hash, stored.encoded.blob});
}

void PutAll(TileStore& store, const TinyWorld& world) {
  for (const auto& [id, stored] : world.tiles()) {
    ASSERT_TRUE(Put(store, world, id).ok());
  }
}

// One by one, which also is what `held_bytes` is.
std::uint64_t BytesOfAll(const TileStore& store) {
  return store.BytesOf(store.Tiles());
}

TEST(StoreBytesTest, InMemoryTheyAreThoseOfTheBlobs) {
  TinyWorld world = SquareWorld(6);
  TileStore store = *TileStore::Open(TinyAtlas(), {.max_memory_bytes = kMiB});
  EXPECT_EQ(store.capacity_bytes(), kMiB);
  PutAll(store, world);
  EXPECT_EQ(store.held_bytes(), store.memory_bytes());
  EXPECT_EQ(store.held_bytes(), BytesOfAll(store));
  world.Put(DenseTile(2, 2));
  ASSERT_TRUE(Put(store, world, {0, 2, 2}).ok());
  EXPECT_EQ(store.held_bytes(), store.memory_bytes()) << "after another content of a tile";
  store.Remove({0, 2, 2});
  EXPECT_EQ(store.held_bytes(), store.memory_bytes());
  EXPECT_EQ(store.BytesOf({{0, 2, 2}}), 0U);
}

TEST(StoreBytesTest, WithAFolderThoseOfTheFilesAlsoAfterARestart) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(6);
  const TileStoreOptions options{.max_memory_bytes = 2'000, .folder = folder.path()};
  {
    TileStore store = *TileStore::Open(TinyAtlas(), options);
    EXPECT_EQ(store.capacity_bytes(), options.max_disk_bytes);
    PutAll(store, world);
    PutAll(store, world);  // over files that are there
    EXPECT_EQ(store.size(), world.tiles().size());
    EXPECT_EQ(store.held_bytes(), store.disk_bytes());
  }
  TileStore store = *TileStore::Open(TinyAtlas(), options);
  EXPECT_EQ(store.held_bytes(), store.disk_bytes());
  EXPECT_EQ(store.held_bytes(), BytesOfAll(store));
}

TEST(StoreBytesTest, WhatIsDroppedCountsNoMore) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(8);
  for (const bool has_folder : {false, true}) {
    TileStoreOptions options{.max_memory_bytes = 6'000, .max_disk_bytes = 12'000};
    if (has_folder) options.folder = folder.path();
    TileStore store = *TileStore::Open(TinyAtlas(), options);
    PutAll(store, world);
    EXPECT_LT(store.size(), world.tiles().size());
    EXPECT_LE(store.held_bytes(), store.capacity_bytes());
    EXPECT_EQ(store.held_bytes(), BytesOfAll(store));
  }
}

// The coarse tiles elsewhere stay longest: what they take is no room for others.
TEST(StoreBytesTest, CoarseTilesElsewhereAreNoRoom) {
  const TinyWorld world = SquareWorld(8);
  TileStore store = *TileStore::Open(TinyAtlas(), {.max_memory_bytes = kMiB});
  PutAll(store, world);
  std::vector<TileId> coarse;
  for (const TileId& id : store.Tiles()) {
    if (id.level >= 2) coarse.push_back(id);
  }
  ASSERT_EQ(coarse.size(), 5U);
  EXPECT_EQ(store.RoomAmong(coarse), kMiB);
  EXPECT_EQ(store.RoomAmong(store.Tiles()), kMiB);
  EXPECT_EQ(store.RoomAmong({}), kMiB - store.BytesOf(coarse));
  EXPECT_EQ(store.RoomAmong({coarse[0]}),
            kMiB - store.BytesOf(coarse) + store.BytesOf({coarse[0]}));
}

TEST(StoreBytesTest, CoarseTilesElsewhereAreAQuarterWhereThereIsNoRoom) {
  const TinyWorld world = SquareWorld(32);
  const TestFolder folder;
  for (const bool has_folder : {false, true}) {
    TileStoreOptions options{.max_memory_bytes = 10'000, .max_disk_bytes = 12'000};
    if (has_folder) options.folder = folder.path();
    TileStore store = *TileStore::Open(TinyAtlas(), options);
    for (const auto& [id, stored] : world.tiles()) {
      if (id.level == 2) {
        ASSERT_TRUE(Put(store, world, id).ok());
      }
    }
    ASSERT_GT(store.held_bytes(), store.capacity_bytes() / 2);
    const std::vector<TileId> all = store.Tiles();
    const std::vector<TileId> kept(all.begin(), all.begin() + 3);
    store.RemoveCoarse(all);
    EXPECT_EQ(store.size(), all.size()) << "none is elsewhere";
    store.RemoveCoarse(kept);
    EXPECT_LE(store.held_bytes() - store.BytesOf(kept), store.capacity_bytes() / 4);
    EXPECT_GT(store.size(), kept.size());
    EXPECT_EQ(store.held_bytes(), BytesOfAll(store));
    for (const TileId& id : kept) {
      EXPECT_NE(store.Find(id), nullptr) << id;
    }
  }
}

// Where memory is larger than disk, a restart leaves what the disk had, and no more goes then.
TEST(StoreBytesTest, WhatTheDiskLosesIsReadIntoMemoryThatHasRoom) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(8);
  const TileStoreOptions options{
      .max_memory_bytes = kMiB, .folder = folder.path(), .max_disk_bytes = 12'000};
  {
    TileStore store = *TileStore::Open(TinyAtlas(), options);
    PutAll(store, world);
    ASSERT_EQ(store.size(), world.tiles().size());
  }
  TileStore store = *TileStore::Open(TinyAtlas(), options);
  const std::vector<TileId> left = store.Tiles();
  ASSERT_GT(left.size(), 4U);
  ASSERT_LT(left.size(), world.tiles().size());
  EXPECT_EQ(store.memory_bytes(), 0U);
  for (const auto& [id, stored] : world.tiles()) {
    if (store.Find(id) == nullptr) {
      ASSERT_TRUE(Put(store, world, id).ok());
    }
  }
  EXPECT_EQ(store.size(), world.tiles().size());
  EXPECT_TRUE(store.TakeDropped().empty());
  EXPECT_LE(store.disk_bytes(), options.max_disk_bytes);
  for (const TileId& id : left) {
    const auto blob = store.Read(id);
    ASSERT_TRUE(blob) << blob.error().message();
    EXPECT_EQ(**blob, world.tiles().at(id).encoded.blob) << id;
  }
}

TEST(StoreBytesTest, WhereMemoryHasNoRoomEitherItGoes) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(8);
  TileStoreOptions options{
      .max_memory_bytes = kMiB, .folder = folder.path(), .max_disk_bytes = 12'000};
  {
    TileStore store = *TileStore::Open(TinyAtlas(), options);
    PutAll(store, world);
  }
  options.max_memory_bytes = 4'000;
  TileStore store = *TileStore::Open(TinyAtlas(), options);
  PutAll(store, world);
  EXPECT_LT(store.size(), world.tiles().size());
  EXPECT_LE(store.memory_bytes(), options.max_memory_bytes);
  EXPECT_LE(store.disk_bytes(), options.max_disk_bytes);
  EXPECT_EQ(store.held_bytes(), BytesOfAll(store));
}

}  // namespace
}  // namespace atlas
