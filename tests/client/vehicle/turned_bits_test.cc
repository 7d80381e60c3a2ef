// Each bit of what a vehicle keeps on its disk turns in its turn, in names as in files: what was
// written is read, or nothing is.
#include <string>

#include "client/vehicle/spooled_keyframe.h"
#include "client/vehicle/stored_file.h"
#include "client/vehicle/tile_files.h"
#include "tests/client/vehicle/test_folder.h"
#include "tests/client/vehicle/tiny_world.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxBytes = 1 << 20;

// Calls with `bytes`, of which one bit is turned, for each bit, or one in ten where little
// is to be tried.
template <typename Check>
void ForEachBit(Bytes bytes, const Check& check) {
  ASSERT_FALSE(bytes.empty());
  for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += testing::Stride()) {
    SCOPED_TRACE(bit);
    std::uint8_t& byte = bytes[bit / 8];
    byte ^= static_cast<std::uint8_t>(1U << bit % 8);
    check(bytes);
    byte ^= static_cast<std::uint8_t>(1U << bit % 8);
    if (::testing::Test::HasFailure()) return;
  }
}

// The folder of an atlas with one tile.
class TurnedBitsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    TinyWorld world;
    world.Set(3, -4, 1'000);
    const auto& [id, stored] = *world.tiles().begin();
    facts_ = {id, stored.revision, stored.encoded.payload_hash, kEverySection};
    blob_ = stored.encoded.blob;
    ASSERT_TRUE(files().Write(facts_, blob_));
    for (const auto& entry : fs::directory_iterator(files().folder())) {
      if (entry.path().extension() == ".tile") tile_ = entry.path();
    }
    ASSERT_FALSE(tile_.empty());
  }

  TileFiles files() const { return *TileFiles::Open(folder_.path(), TinyAtlas()); }

  TestFolder folder_;
  TileFacts facts_;
  Bytes blob_;
  fs::path tile_;
};

TEST_F(TurnedBitsTest, OfATileAreDamage) {
  const TileFiles files = this->files();
  ASSERT_EQ(files.Read(facts_).value(), blob_);
  ForEachBit(*LoadFile(tile_, kMaxBytes), [&](const Bytes& turned) {
    ASSERT_TRUE(StoreFile(tile_, turned, Durability::kWhole).ok());
    const auto blob = files.Read(facts_);
    ASSERT_FALSE(blob);
    EXPECT_EQ(blob.error().code(), StatusCode::kInvalidData);
  });
}

TEST_F(TurnedBitsTest, OfTheNameOfATileAreAnotherTileThatIsNotThere) {
  TileFiles files = this->files();
  const std::string name = tile_.filename().string();
  std::size_t listed = 0;
  ForEachBit(Bytes(name.begin(), name.end()), [&](const Bytes& turned) {
    const std::string other(turned.begin(), turned.end());
    if (other.find('/') != std::string::npos || other.find('\0') != std::string::npos) return;
    const fs::path renamed = tile_.parent_path() / other;
    fs::rename(tile_, renamed);
    const std::vector<TileFiles::Found> all = files.List().value();
    for (const TileFiles::Found& found : all) {
      ++listed;
      const auto blob = files.Read(found.facts);
      ASSERT_FALSE(blob) << other;
      EXPECT_TRUE(blob.error().code() == StatusCode::kInvalidData ||
                  blob.error().code() == StatusCode::kNotFound)
          << blob.error().message();
    }
    fs::rename(renamed, tile_);
  });
  EXPECT_GT(listed, 0U) << "some names are those of tiles";
}

TEST_F(TurnedBitsTest, OfTheFileThatSaysWhichAtlasItIsMakeItNone) {
  const fs::path atlas = tile_.parent_path() / kAtlasFileName;
  ASSERT_EQ(KnownAtlases(folder_.path()), std::vector<AtlasKey>{TinyAtlas()});
  ForEachBit(*LoadFile(atlas, kMaxBytes), [&](const Bytes& turned) {
    ASSERT_TRUE(StoreFile(atlas, turned, Durability::kWhole).ok());
    EXPECT_TRUE(KnownAtlases(folder_.path()).empty());
  });
  // Whoever is told by a daemon which one it is has its tiles as well.
  EXPECT_EQ(files().Read(facts_).value(), blob_);
  EXPECT_EQ(KnownAtlases(folder_.path()), std::vector<AtlasKey>{TinyAtlas()});
}

TEST_F(TurnedBitsTest, OfAKeyframeThatWaitsAreDamage) {
  const KeyframeUpload upload{{{"bus", "day"}, 7}, 1'700'000'000'000, {}, blob_, true};
  ASSERT_TRUE(DecodeSpooled(EncodeSpooled(upload)));
  ForEachBit(EncodeSpooled(upload), [](const Bytes& turned) {
    const auto keyframe = DecodeSpooled(turned);
    ASSERT_FALSE(keyframe);
    EXPECT_EQ(keyframe.error().code(), StatusCode::kInvalidData);
  });
}

}  // namespace
}  // namespace atlas
