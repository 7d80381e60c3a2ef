#include "core/tile/tile_codec.h"

#include <gtest/gtest.h>

#include "core/base/compression.h"
#include "core/base/hash.h"
#include "core/tile/raw_container.h"
#include "core/tile/tile_container.h"
#include "core/tile/tile_sections.h"
#include "tests/core/support/golden.h"
#include "tests/core/support/golden_profile.h"
#include "tests/core/support/test_scale.h"
#include "tests/core/support/tile_worlds.h"

namespace atlas {
namespace {

using testing::RandomTile;

MapProfile SmallProfile() {
  MapProfile profile;
  profile.tile_cells = 16;
  return profile;
}

StatusCode DecodeError(ByteSpan blob) {
  const auto result = DecodeTile(blob, SmallProfile());
  return result ? StatusCode::kOk : result.error().code();
}

// A blob of `tile` with one section's content changed, all checksums right.
template <typename Change>
Bytes WithSection(const Tile& tile, TileSection section, const Change& change) {
  TileContainer container = DecodeContainer(EncodeTile(tile, SmallProfile()).blob).value();
  for (auto& entry : container.sections) {
    if (entry.id == static_cast<std::uint16_t>(section)) {
      change(entry.content);
    }
  }
  return EncodeContainer(container);
}

TEST(TileCodecTest, RandomTilesReadBack) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(40); ++seed) {
    MapProfile profile = SmallProfile();
    profile.tile_cells = static_cast<std::uint16_t>(16u << (seed % 3));
    profile.column_segments = static_cast<std::uint8_t>(2u << (seed % 4));
    const Tile tile = RandomTile({static_cast<std::uint8_t>(seed % 8), -7, 12}, profile, seed);
    const EncodedTile encoded = EncodeTile(tile, profile);
    const auto decoded = DecodeTile(encoded.blob, profile);
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message();
    EXPECT_EQ(*decoded, tile);
    EXPECT_EQ(EncodeTile(*decoded, profile).blob, encoded.blob);
  }
}

TEST(TileCodecTest, ABlobHoldsItsCanonicalPayload) {
  const Tile tile = RandomTile({0, 3, 4}, SmallProfile(), 5);
  const EncodedTile encoded = EncodeTile(tile, SmallProfile());
  const Bytes payload = TilePayloadFromBlob(encoded.blob).value();
  EXPECT_EQ(payload, EncodeTilePayload(tile, SmallProfile()));
  EXPECT_EQ(Hash64(payload), encoded.payload_hash);
}

TEST(TileCodecTest, ThePayloadMovesWithEveryField) {
  const Tile tile = RandomTile({0, 3, 4}, SmallProfile(), 6);
  const Bytes payload = EncodeTilePayload(tile, SmallProfile());
  const auto moved = [&](auto change) {
    Tile other = tile;
    change(other);
    return EncodeTilePayload(other, SmallProfile()) != payload;
  };
  EXPECT_TRUE(moved([](Tile& t) { t.id.x += 1; }));
  EXPECT_TRUE(moved([](Tile& t) { t.contributors[0].session = "other"; }));
  EXPECT_TRUE(moved([](Tile& t) { t.layers[9].altitude_mm += 1; }));
  EXPECT_TRUE(
      moved([](Tile& t) { t.layers[9].sigma_100um = t.layers[9].sigma_100um == 1 ? 2 : 1; }));
  EXPECT_TRUE(moved([](Tile& t) { t.layers[9].occupancy ^= 1; }));
  EXPECT_TRUE(moved([](Tile& t) { t.layers[9].flags ^= 1; }));
  EXPECT_TRUE(moved([](Tile& t) { t.layers[9].observations ^= 1; }));
  EXPECT_TRUE(moved([](Tile& t) { t.layers[9].column ^= 0x70; }));
}

TEST(TileCodecTest, RefusesTruncationAtEveryByte) {
  const Bytes blob = EncodeTile(RandomTile({0, 0, 0}, SmallProfile(), 7), SmallProfile()).blob;
  for (std::size_t size = 0; size < blob.size(); ++size) {
    EXPECT_EQ(DecodeError(ByteSpan(blob).first(size)), StatusCode::kInvalidData) << size;
    EXPECT_FALSE(TilePayloadFromBlob(ByteSpan(blob).first(size)).has_value()) << size;
  }
}

TEST(TileCodecTest, RefusesEveryFlippedBit) {
  const Bytes blob = EncodeTile(RandomTile({0, 0, 0}, SmallProfile(), 8), SmallProfile()).blob;
  for (std::size_t bit = 0; bit < 8 * blob.size(); ++bit) {
    Bytes damaged = blob;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_NE(DecodeError(damaged), StatusCode::kOk) << "bit " << bit;
    EXPECT_FALSE(TilePayloadFromBlob(damaged).has_value()) << "bit " << bit;
  }
}

TEST(TileCodecTest, RefusesTrailingBytesOtherProfilesAndNewerVersions) {
  Bytes blob = EncodeTile(RandomTile({0, 0, 0}, SmallProfile(), 9), SmallProfile()).blob;
  EXPECT_EQ(DecodeTile(blob, MapProfile()).error().code(), StatusCode::kInvalidData);
  blob.push_back(0);
  EXPECT_EQ(DecodeError(blob), StatusCode::kInvalidData);
  blob.pop_back();
  blob[4] = 3;
  EXPECT_EQ(DecodeError(blob), StatusCode::kUnsupported);
}

TEST(TileCodecTest, SkipsUnknownSectionsAndMissesColumnsGracefully) {
  const Tile tile = RandomTile({0, 0, 0}, SmallProfile(), 10);
  TileContainer container = DecodeContainer(EncodeTile(tile, SmallProfile()).blob).value();
  container.sections.push_back({900, {1, 2, 3}});
  EXPECT_EQ(DecodeTile(EncodeContainer(container), SmallProfile()).value(), tile);

  container.sections.erase(container.sections.begin() + 2);  // columns
  Tile bare = tile;
  for (TileLayer& layer : bare.layers) {
    layer.column = 0;
  }
  EXPECT_EQ(DecodeTile(EncodeContainer(container), SmallProfile()).value(), bare);

  container.sections.erase(container.sections.begin() + 1);  // surface
  EXPECT_EQ(DecodeError(EncodeContainer(container)), StatusCode::kInvalidData);
}

TEST(TileCodecTest, SectionsAreTakenApartAndPutTogether) {
  const Tile tile = RandomTile({0, 0, 0}, SmallProfile(), 12);
  const Bytes blob = EncodeTile(tile, SmallProfile()).blob;
  EXPECT_EQ(SelectSections(blob, kAllSections).value(), blob);
  for (SectionMask sections = 0; sections < 1u << 5; sections += 2) {
    const Bytes part = SelectSections(blob, sections).value();
    const Bytes rest = SelectSections(blob, ~sections).value();
    EXPECT_LT(part.size(), sections == 0b11110 ? blob.size() + 1 : blob.size());
    EXPECT_EQ(MergeSections(part, rest).value(), blob) << sections;
    EXPECT_EQ(MergeSections(rest, part).value(), blob) << sections;
    EXPECT_EQ(MergeSections(blob, part).value(), blob) << sections;
  }
  // Whoever has the surface alone has the tile without the rest.
  const auto surface = std::uint64_t{1} << static_cast<int>(TileSection::kSurface);
  const auto contributors = std::uint64_t{1} << static_cast<int>(TileSection::kContributors);
  const auto bare =
      DecodeTile(SelectSections(blob, surface | contributors).value(), SmallProfile());
  ASSERT_TRUE(bare.has_value()) << bare.error().message();
  EXPECT_EQ(bare->layers.size(), tile.layers.size());
}

TEST(TileCodecTest, SectionsOfDifferentTilesDoNotGoTogether) {
  const Bytes a = EncodeTile(RandomTile({0, 0, 0}, SmallProfile(), 1), SmallProfile()).blob;
  const Bytes b = EncodeTile(RandomTile({0, 1, 0}, SmallProfile(), 1), SmallProfile()).blob;
  EXPECT_EQ(MergeSections(a, b).error().code(), StatusCode::kInvalidArgument);
  for (std::size_t size = 0; size < a.size(); ++size) {
    const Bytes cut(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(SelectSections(cut, kAllSections).error().code(), StatusCode::kInvalidData);
    EXPECT_EQ(MergeSections(a, cut).error().code(), StatusCode::kInvalidData);
  }
}

// Tables that lie, with a checksum that fits.
TEST(TileCodecTest, RefusesTablesAboveTheLimits) {
  const Bytes content = Compress({}, 1);
  const auto code_of = [&content](std::size_t count, std::uint32_t uncompressed_bytes) {
    RawContainer raw{TileId{}.Key(), SmallProfile().Hash(), 1, {}};
    for (std::size_t i = 0; i < count; ++i) {
      raw.sections.push_back(
          {static_cast<std::uint16_t>(i), uncompressed_bytes, Hash64(content), content});
    }
    const auto container = DecodeContainer(WriteRaw(raw, kTileMagic));
    return container ? StatusCode::kOk : container.error().code();
  };
  EXPECT_EQ(code_of(64, 0), StatusCode::kOk);
  EXPECT_EQ(code_of(65, 0), StatusCode::kInvalidData);
  EXPECT_EQ(code_of(1, 1), StatusCode::kInvalidData);  // it is empty
  EXPECT_EQ(code_of(1, kMaxTileBytes + 1), StatusCode::kInvalidData);
  EXPECT_EQ(code_of(2, kMaxTileBytes / 2 + 1), StatusCode::kInvalidData);  // of all together
  EXPECT_EQ(code_of(2, UINT32_MAX), StatusCode::kInvalidData);
}

TEST(TileCodecTest, SectionsThatAreTooManyTogetherStayApart) {
  const auto blob_of = [](std::uint16_t first) {
    TileContainer container;
    for (std::uint16_t id = first; id < first + 40; ++id) {
      container.sections.push_back({id, {}});
    }
    return EncodeContainer(container);
  };
  EXPECT_TRUE(MergeSections(blob_of(0), blob_of(20)).has_value());  // 60
  EXPECT_EQ(MergeSections(blob_of(0), blob_of(40)).error().code(), StatusCode::kInvalidData);
}

// Poses end at 20 km: nothing that reads a tile need fear for its sums.
TEST(TileCodecTest, RefusesLayersOffTheWorld) {
  const Tile tile = RandomTile({0, 0, 0}, SmallProfile(), 13);
  const auto code_at = [&tile](std::int32_t altitude_mm) {
    Tile moved = tile;
    moved.cell_begin.assign(moved.cell_begin.size(), 1);
    moved.cell_begin[0] = 0;
    moved.layers.resize(1);
    moved.layers[0].altitude_mm = altitude_mm;
    return DecodeError(EncodeTile(moved, SmallProfile()).blob);
  };
  for (const std::int32_t sign : {-1, 1}) {
    EXPECT_EQ(code_at(sign * kMaxAltitude_mm), StatusCode::kOk);
    EXPECT_EQ(code_at(sign * (kMaxAltitude_mm + 1)), StatusCode::kInvalidData);
    EXPECT_EQ(code_at(sign * INT32_MAX), StatusCode::kInvalidData);
  }
  EXPECT_EQ(code_at(INT32_MIN), StatusCode::kInvalidData);
}

TEST(TileCodecTest, RefusesSectionsThatLie) {
  const Tile tile = RandomTile({0, 0, 0}, SmallProfile(), 11);
  const auto refused = [&](TileSection section, auto change) {
    return DecodeError(WithSection(tile, section, change)) == StatusCode::kInvalidData;
  };
  EXPECT_FALSE(refused(TileSection::kSurface, [](Bytes&) {}));
  EXPECT_TRUE(refused(TileSection::kSurface, [](Bytes& b) { b.pop_back(); }));
  EXPECT_TRUE(refused(TileSection::kSurface, [](Bytes& b) { b.push_back(0); }));
  EXPECT_TRUE(refused(TileSection::kSurface, [](Bytes& b) { b[0] = 17; }));     // layer count
  EXPECT_TRUE(refused(TileSection::kSurface, [](Bytes& b) { b.back() = 8; }));  // unknown flag
  EXPECT_TRUE(refused(TileSection::kColumns, [](Bytes& b) { b.pop_back(); }));
  EXPECT_TRUE(refused(TileSection::kColumns, [](Bytes& b) { b[0] ^= 1; }));  // one more or less
  EXPECT_TRUE(refused(TileSection::kContributors, [](Bytes& b) { b[0] = 200; }));
  EXPECT_TRUE(refused(TileSection::kContributors, [](Bytes& b) { b.push_back(0); }));
  EXPECT_TRUE(refused(TileSection::kContributors, [](Bytes& b) { b[2] = ' '; }));
}

TEST(TileCodecTest, RefusesLayersAndContributorsOutOfOrder) {
  Tile tile = EmptyTile({0, 0, 0}, SmallProfile());
  tile.contributors = {{"car", "b"}, {"car", "a"}};
  EXPECT_EQ(DecodeError(EncodeTile(tile, SmallProfile()).blob), StatusCode::kInvalidData);
  tile.contributors = {{"car", "a"}, {"car", "a"}};
  EXPECT_EQ(DecodeError(EncodeTile(tile, SmallProfile()).blob), StatusCode::kInvalidData);
  tile.contributors = {{"car", "a"}};
  tile.layers.resize(2);
  tile.layers[0].altitude_mm = 1;
  std::fill(tile.cell_begin.begin() + 1, tile.cell_begin.end(), 2u);
  EXPECT_EQ(DecodeError(EncodeTile(tile, SmallProfile()).blob), StatusCode::kInvalidData);
}

TEST(TileCodecTest, GoldenFileReadsAndEncodesEqual) {
  const MapProfile profile = testing::GoldenProfile();
  const Tile tile = RandomTile({2, -5, 77}, profile, 42);
  const Bytes golden = testing::GoldenFile("tile_v2.bin", EncodeTile(tile, profile).blob);
  const auto decoded = DecodeTile(golden, profile);
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message();
  EXPECT_EQ(*decoded, tile);
  EXPECT_EQ(EncodeTile(*decoded, profile).blob, golden);
}

}  // namespace
}  // namespace atlas
