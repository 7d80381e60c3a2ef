#include "server/store/tile_directory.h"

#include <atomic>
#include <thread>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

constexpr std::size_t kMuch = std::size_t{1} << 20;
const TileId kA{0, 0, 0};
const TileId kB{0, 7, 7};  // of the same block
const TileId kC{0, 8, 0};  // of the next one
const TileId kFar{3, -1, 5};

TileBlock BlockOf(std::initializer_list<TileId> ids) {
  std::vector<TileSummary> tiles;
  for (const TileId& id : ids) {
    tiles.push_back({id, 1, 2, 3});
  }
  return std::make_shared<const std::vector<TileSummary>>(std::move(tiles));
}

TEST(TileBlockTest, HoldsEightByEightTiles) {
  EXPECT_EQ(TileBlockOf(kA.Key()), TileBlockOf(kB.Key()));
  EXPECT_NE(TileBlockOf(kA.Key()), TileBlockOf(kC.Key()));
  EXPECT_NE(TileBlockOf(kA.Key()), TileBlockOf(TileId{1, 0, 0}.Key()));
  EXPECT_EQ(FirstKeyOf(TileBlockOf(kB.Key())), kA.Key());
  EXPECT_EQ(TileBlockOf(TileId{0, -1, -1}.Key()), TileBlockOf(TileId{0, -8, -8}.Key()));
}

TEST(TileDirectoryTest, KeepsWhatWasRead) {
  TileDirectory directory(kMuch);
  const std::uint64_t block = TileBlockOf(kA.Key());
  EXPECT_EQ(directory.Find(block), nullptr);
  directory.Insert(block, directory.Version(block), BlockOf({kA, kB}));
  ASSERT_NE(directory.Find(block), nullptr);
  EXPECT_EQ(directory.Find(block)->size(), 2u);
}

TEST(TileDirectoryTest, NothingOfABlockThatChangedIsKept) {
  TileDirectory directory(kMuch);
  const std::uint64_t block = TileBlockOf(kA.Key());
  directory.Insert(block, directory.Version(block), BlockOf({kA}));
  const std::uint64_t before = directory.Version(block);
  directory.Forget(kB);
  EXPECT_EQ(directory.Find(block), nullptr);
  directory.Insert(block, before, BlockOf({kA}));  // read before the change
  EXPECT_EQ(directory.Find(block), nullptr);
  directory.Insert(block, directory.Version(block), BlockOf({kA, kB}));
  EXPECT_NE(directory.Find(block), nullptr);
}

TEST(TileDirectoryTest, OtherBlocksStay) {
  TileDirectory directory(kMuch);
  for (const TileId& id : {kA, kC, kFar}) {
    const std::uint64_t block = TileBlockOf(id.Key());
    directory.Insert(block, directory.Version(block), BlockOf({id}));
  }
  directory.Forget(kC);
  EXPECT_NE(directory.Find(TileBlockOf(kA.Key())), nullptr);
  EXPECT_EQ(directory.Find(TileBlockOf(kC.Key())), nullptr);
  EXPECT_NE(directory.Find(TileBlockOf(kFar.Key())), nullptr);
}

TEST(TileDirectoryTest, IsBounded) {
  TileDirectory directory(10'000);
  for (std::int32_t x = 0; x < 1'000; ++x) {
    const std::uint64_t block = TileBlockOf(TileId{0, 8 * x, 0}.Key());
    directory.Insert(block, directory.Version(block), BlockOf({TileId{0, 8 * x, 0}}));
    EXPECT_LE(directory.bytes(), 10'000u);
    EXPECT_NE(directory.Find(block), nullptr);
  }
  EXPECT_EQ(directory.Find(TileBlockOf(kA.Key())), nullptr);
}

using StoreTileBlockTest = StoreTest;

TEST_F(StoreTileBlockTest, TellsWhichTilesThereAre) {
  Open();
  EXPECT_TRUE(store_->ReadTileBlock(TileBlockOf(kA.Key())).value()->empty());
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA, kB, kC})).has_value());
  for (const TileClaim& claim : Claim().claims) {
    ASSERT_TRUE(Finish(claim, Content(static_cast<std::uint8_t>(claim.id.x + 1))).has_value());
  }
  EXPECT_EQ(store_->FindTileBlock(TileBlockOf(kA.Key())), nullptr);
  const TileBlock block = store_->ReadTileBlock(TileBlockOf(kA.Key())).value();
  ASSERT_EQ(block->size(), 2u);
  EXPECT_EQ(block->at(0).id, kA);
  EXPECT_EQ(block->at(0).payload_hash, 1u);
  EXPECT_EQ(block->at(0).blob_bytes, 4u);
  EXPECT_EQ(block->at(1).id, kB);
  EXPECT_EQ(store_->FindTileBlock(TileBlockOf(kA.Key())), block);
  ASSERT_TRUE(Put(MakeKeyframe(2, {kB})).has_value());
  ASSERT_TRUE(Finish(Claim(1u << 30, "x").claims.at(0), std::nullopt).has_value());
  EXPECT_EQ(store_->ReadTileBlock(TileBlockOf(kA.Key())).value()->size(), 1u);
}

// One writes a tile again and again; the others must never see less than was acknowledged.
TEST_F(StoreTileBlockTest, NobodySeesLessThanWasAcknowledged) {
  constexpr std::uint32_t kWrites = 300;
  Open();
  std::atomic<std::uint64_t> acknowledged = 0;
  std::atomic<bool> is_done = false;
  std::atomic<int> wrong = 0;
  std::vector<std::jthread> readers;
  for (int i = 0; i < 3; ++i) {
    readers.emplace_back([&] {
      while (!is_done) {
        const std::uint64_t at_least = acknowledged;
        const TileBlock block = store_->ReadTileBlock(TileBlockOf(kA.Key())).value();
        const std::uint64_t seen = block->empty() ? 0 : block->at(0).revision;
        wrong += seen < at_least ? 1 : 0;
      }
    });
  }
  for (std::uint32_t i = 1; i <= kWrites; ++i) {
    ASSERT_TRUE(Put(MakeKeyframe(i, {kA})).has_value());
    for (const TileClaim& claim : Claim(1u << 30, "w", 1'000 + i).claims) {
      if (claim.id == kA) {
        const auto content = Content(static_cast<std::uint8_t>(i));
        acknowledged = Finish(claim, content).value().revision;
      }
    }
  }
  is_done = true;
  readers.clear();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(acknowledged, kWrites);
}

}  // namespace
}  // namespace atlas
