#include "server/service/sync/held_tiles.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

HeldTile Tile(const TileId& id) {
  return {id.Key(), 7};
}

TEST(HeldTilesTest, AreFoundByTheirKeys) {
  const TileId a{0, 3, 4};
  const TileId b{2, -5, 1};
  const auto held =
      HeldTiles::Create({Tile(a), Tile(b)}, {{TileBlockOf(TileId{1, 8, 8}.Key()), 1, 2}});
  ASSERT_TRUE(held.has_value()) << held.error().message();
  ASSERT_NE(held->Find(a.Key()), nullptr);
  EXPECT_EQ(held->Find(a.Key())->payload_hash, 7u);
  EXPECT_EQ(held->Find(TileId{0, 3, 5}.Key()), nullptr);
  EXPECT_NE(held->FindBlock(TileBlockOf(TileId{1, 15, 15}.Key())), nullptr);
  EXPECT_EQ(held->FindBlock(TileBlockOf(TileId{1, 16, 15}.Key())), nullptr);
  EXPECT_EQ(held->FindBlock(0), nullptr);
}

TEST(HeldTilesTest, ThoseThatAreKeptAreNumberedAnew) {
  const TileId a{0, 3, 4};
  const TileId b{2, -5, 1};
  HeldTiles held =
      HeldTiles::Create({Tile(a), Tile(b)}, {{TileBlockOf(TileId{1, 8, 8}.Key()), 1, 2}}).value();
  const std::size_t all_bytes = held.bytes();
  std::vector<bool> is_kept(2);
  is_kept[static_cast<std::size_t>(held.Find(b.Key()) - held.tiles().data())] = true;
  held.KeepOnly(is_kept, {false});
  EXPECT_EQ(held.Find(a.Key()), nullptr);
  ASSERT_NE(held.Find(b.Key()), nullptr);
  EXPECT_EQ(held.Find(b.Key())->number, 0u);
  EXPECT_TRUE(held.blocks().empty());
  EXPECT_LT(held.bytes(), all_bytes / 2);
}

TEST(HeldTilesTest, AreNumberedAsTheyWereTold) {
  const TileId a{0, 3, 4};
  const TileId b{0, 4, 4};
  const HeldTiles held = HeldTiles::Create({Tile(b), Tile(a)}, {}).value();
  EXPECT_EQ(held.Find(b.Key())->number, 0u);
  EXPECT_EQ(held.Find(a.Key())->number, 1u);
}

TEST(HeldTilesTest, RefusesWhatMakesNoSense) {
  const auto code = [](std::vector<HeldTile> tiles, std::vector<HeldBlock> blocks) {
    const auto held = HeldTiles::Create(std::move(tiles), std::move(blocks));
    return held ? StatusCode::kOk : held.error().code();
  };
  const TileId a{0, 3, 4};
  const TileId b{0, 4, 4};
  const std::uint64_t block = TileBlockOf(a.Key());
  EXPECT_EQ(code({Tile(a), Tile(b)}, {}), StatusCode::kOk);
  EXPECT_EQ(code({Tile(a), Tile(a)}, {}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{~std::uint64_t{0}, 1}}, {}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({}, {{block, 1, 2}, {block, 1, 2}}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({}, {{std::uint64_t{1} << 60, 1, 2}}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({Tile(a)}, {{block, 1, 2}}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(std::vector<HeldTile>(HeldTiles::kMaxTiles + 1), {}),
            StatusCode::kInvalidArgument);
}

// docs/protocol.md has these bytes.
TEST(HeldTilesTest, TheDigestIsOfKeysAndHashesInLittleEndian) {
  HeldDigest digest;
  EXPECT_EQ(digest.value(), 0xef46db3751d8e999u);  // XXH64 of nothing
  digest.Add(TileId{0, 0, 0}.Key(), 1);
  digest.Add(TileId{0, 1, 0}.Key(), 2);
  EXPECT_EQ(digest.value(), 0x459ad8e8d4cb3ef7u);
}

}  // namespace
}  // namespace atlas
