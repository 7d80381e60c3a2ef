// Several atlases in one folder share its bytes: those that are not open make room.
#include "client/vehicle/other_atlases.h"

#include <fstream>
#include <numeric>

#include <gtest/gtest.h>

#include "client/vehicle/tile_store.h"
#include "tests/client/vehicle/sync_peer.h"
#include "tests/client/vehicle/test_folder.h"
#include "tests/core/support/no_descriptors.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

AtlasKey Atlas(std::uint8_t id) {
  return {Bytes(16, id), TinyProfile()};
}

std::uint64_t BytesBelow(const fs::path& root) {
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.is_regular_file()) bytes += entry.file_size();
  }
  return bytes;
}

class OtherAtlasesTest : public testing::Test {
 protected:
  OtherAtlasesTest() {
    for (int i = 0; i < 20; ++i) {
      world_.Set(i, 0, 100 * i);
    }
  }

  TileStore Open(const AtlasKey& atlas, std::uint64_t max_bytes = ~std::uint64_t{0}) const {
    return *TileStore::Open(atlas, {.folder = folder_.path(), .max_disk_bytes = max_bytes});
  }
  void Put(TileStore& store, const TileId& id) const {
    const auto& stored = world_.tiles().at(id);
    ASSERT_TRUE(
        store.Put({id, stored.revision, stored.encoded.payload_hash, stored.encoded.blob}).ok());
  }
  // Of the atlas whose id is this byte sixteen times, on the disk.
  std::size_t TilesOf(int id) const {
    std::string name;
    for (int i = 0; i < 16; ++i) {
      name += "0" + std::to_string(id);
    }
    std::size_t tiles = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path() / name)) {
      tiles += entry.path().extension() == ".tile" ? 1U : 0U;
    }
    return tiles;
  }
  // All tiles of the world; the bytes on the disk.
  std::uint64_t Fill(const AtlasKey& atlas) const {
    TileStore store = Open(atlas);
    const std::uint64_t before = store.disk_bytes();
    for (const auto& [id, stored] : world_.tiles()) {
      Put(store, id);
    }
    return store.disk_bytes() - before;
  }

  TestFolder folder_;
  TinyWorld world_;
};

TEST_F(OtherAtlasesTest, MakeRoomTheOneOpenedLongestAgoFirst) {
  const std::uint64_t one = Fill(Atlas(7));
  ASSERT_EQ(Fill(Atlas(3)), one);
  const std::size_t tiles = world_.tiles().size();
  const std::uint64_t max = 2 * one + one / 2;
  TileStore store = Open(Atlas(5), max);
  std::size_t least = 2 * tiles;
  for (const auto& [id, stored] : world_.tiles()) {
    Put(store, id);
    ASSERT_LE(store.disk_bytes(), max);
    const std::size_t others = TilesOf(3) + TilesOf(7);
    EXPECT_LE(others, least);
    least = others;
  }
  EXPECT_EQ(store.size(), tiles);
  EXPECT_EQ(TilesOf(3), tiles);
  EXPECT_LT(TilesOf(7), tiles);
  EXPECT_GT(TilesOf(7), 0U);
}

// Of any atlas: the folder's bytes are bounded together.
TEST_F(OtherAtlasesTest, ASecondStoreOfTheFolderWorksInMemory) {
  Fill(Atlas(7));
  {
    const TileStore first = Open(Atlas(7));
    EXPECT_TRUE(first.disk_problem().ok());
    for (const AtlasKey& atlas : {Atlas(7), Atlas(3)}) {
      TileStore second = Open(atlas);
      EXPECT_EQ(second.disk_problem().code(), StatusCode::kConflict);
      EXPECT_NE(second.disk_problem().message().find(folder_.path().string()), std::string::npos);
      EXPECT_EQ(second.size(), 0U);
      Put(second, world_.tiles().begin()->first);
      EXPECT_EQ(second.size(), 1U);
      EXPECT_EQ(second.disk_failures(), 1U);
    }
  }
  const TileStore later = Open(Atlas(7));
  EXPECT_TRUE(later.disk_problem().ok());
  EXPECT_EQ(later.size(), world_.tiles().size());
}

TEST_F(OtherAtlasesTest, AnEmptyOneIsGoneAndTheOpenOneIsBoundedLast) {
  const std::uint64_t one = Fill(Atlas(7));
  TileStore store = Open(Atlas(5), one / 2);
  EXPECT_LE(store.disk_bytes(), one / 2);
  for (const auto& [id, stored] : world_.tiles()) {
    Put(store, id);
    ASSERT_LE(store.disk_bytes(), one / 2);
  }
  EXPECT_EQ(KnownAtlases(folder_.path()), std::vector{Atlas(5)});
  EXPECT_EQ(AtlasFolders(folder_.path()).size(), 1U);
  EXPECT_GT(store.disk_bytes(), one / 4);
}

TEST_F(OtherAtlasesTest, AFolderThatSaysNothingGoesFirstAndWhatIsNotOursStays) {
  Fill(Atlas(7));
  const fs::path unknown = folder_.path() / std::string(32, 'e');
  fs::create_directories(unknown);
  std::ofstream(unknown / "left.tile") << std::string(1'000, 'x');
  std::ofstream(folder_.path() / "notes") << std::string(1'000, 'x');
  fs::create_directories(folder_.path() / "photos");
  std::ofstream(folder_.path() / "photos" / "one") << std::string(1'000, 'x');
  const std::uint64_t before = BytesBelow(folder_.path());
  OtherAtlases others(folder_.path(), folder_.path() / "none");
  EXPECT_EQ(others.bytes(), before - 2'000);
  others.Remove(1);
  EXPECT_FALSE(fs::exists(unknown));
  EXPECT_EQ(others.bytes(), before - 3'000);
  others.Remove(~std::uint64_t{0});
  EXPECT_EQ(others.bytes(), 0U);
  EXPECT_EQ(BytesBelow(folder_.path()), 2'000U);
  others.Remove(1);
}

TEST_F(OtherAtlasesTest, AFolderThatCannotBeReadNowStays) {
  Fill(Atlas(7));
  OtherAtlases others(folder_.path(), folder_.path() / "none");
  const std::uint64_t before = others.bytes();
  {
    const NoDescriptors none;
    others.Remove(~std::uint64_t{0});
  }
  EXPECT_EQ(others.bytes(), before);
  EXPECT_EQ(KnownAtlases(folder_.path()), std::vector{Atlas(7)});
  EXPECT_EQ(TilesOf(7), world_.tiles().size());
  others.Remove(~std::uint64_t{0});
  EXPECT_EQ(others.bytes(), 0U);
  EXPECT_TRUE(AtlasFolders(folder_.path()).empty());
}

}  // namespace
}  // namespace atlas
