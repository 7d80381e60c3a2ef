#include "core/tile/tile_delta.h"

#include <gtest/gtest.h>

#include "core/tile/tile_codec.h"
#include "core/tile/tile_container.h"
#include "tests/core/support/golden.h"
#include "tests/core/support/golden_profile.h"
#include "tests/core/support/test_scale.h"
#include "tests/core/support/tile_worlds.h"

namespace atlas {
namespace {

using testing::RandomTile;

constexpr TileId kPlace{0, 3, -4};

Bytes BlobOf(const Tile& tile) {
  return EncodeTile(tile, MapProfile()).blob;
}
Tile SomeTile(std::uint32_t seed = 1) {
  return RandomTile(kPlace, MapProfile(), seed);
}
// As after another keyframe on a corner of it.
Tile Touched(Tile tile) {
  for (std::size_t i = 0; i < tile.layers.size() / 20; ++i) {
    ++tile.layers[i].observations;
  }
  return tile;
}
StatusCode CodeOf(const Result<Bytes>& result) {
  return result ? StatusCode::kOk : result.error().code();
}

TEST(TileDeltaTest, AnyContentIsMadeOfAnyOther) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(20); ++seed) {
    const Bytes base = BlobOf(SomeTile(seed));
    const Bytes target = BlobOf(SomeTile(seed + 1));
    const Bytes delta = EncodeTileDelta(base, target).value();
    EXPECT_EQ(ApplyTileDelta(base, delta).value(), target);
  }
}

TEST(TileDeltaTest, OfAContentThatHardlyChangedIsSmall) {
  const Bytes base = BlobOf(SomeTile());
  const Bytes target = BlobOf(Touched(SomeTile()));
  EXPECT_LT(EncodeTileDelta(base, target).value().size(), target.size() / 4);
  EXPECT_LT(EncodeTileDelta(base, base).value().size(), 250u);
}

TEST(TileDeltaTest, TakesWhatSectionsThereAre) {
  const Bytes base = BlobOf(SomeTile());
  const Bytes target = BlobOf(Touched(SomeTile()));
  for (SectionMask held = 0; held < 1u << 5; held += 2) {
    for (SectionMask wanted = 0; wanted < 1u << 5; wanted += 2) {
      const Bytes from = SelectSections(base, held).value();
      const Bytes to = SelectSections(target, wanted).value();
      const Bytes delta = EncodeTileDelta(from, to).value();
      EXPECT_EQ(ApplyTileDelta(from, delta).value(), to);
      // Who holds more has the same content of what is needed.
      const auto of_more = ApplyTileDelta(base, delta);
      EXPECT_TRUE(!of_more || *of_more == to);
    }
  }
}

TEST(TileDeltaTest, AnotherBaseIsNoticed) {
  const Bytes base = BlobOf(SomeTile());
  const Bytes delta = EncodeTileDelta(base, BlobOf(Touched(SomeTile()))).value();
  EXPECT_EQ(CodeOf(ApplyTileDelta(BlobOf(SomeTile(2)), delta)), StatusCode::kInvalidData);
  EXPECT_EQ(CodeOf(ApplyTileDelta(BlobOf(RandomTile({0, 3, -3}, MapProfile(), 1)), delta)),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(EncodeTileDelta(base, BlobOf(RandomTile({1, 3, -4}, MapProfile(), 1)))),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(ApplyTileDelta(base, base)), StatusCode::kInvalidData) << "no difference";
  EXPECT_FALSE(DecodeTile(delta, MapProfile()).has_value());
}

TEST(TileDeltaTest, NoDamageMakesAnotherContent) {
  MapProfile profile;
  profile.tile_cells = 16;
  const Tile tile = RandomTile(kPlace, profile, 7);
  const Bytes base = EncodeTile(tile, profile).blob;
  const Bytes target = EncodeTile(Touched(tile), profile).blob;
  const Bytes delta = EncodeTileDelta(base, target).value();
  for (std::size_t bit = 0; bit < 8 * delta.size(); ++bit) {
    Bytes damaged = delta;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    const auto result = ApplyTileDelta(base, damaged);
    EXPECT_TRUE(!result || *result == target) << "bit " << bit;
  }
  for (std::size_t size = 0; size < delta.size(); ++size) {
    EXPECT_EQ(CodeOf(ApplyTileDelta(base, ByteSpan(delta).first(size))), StatusCode::kInvalidData);
  }
}

TEST(TileDeltaTest, GoldenFileApplies) {
  const MapProfile profile = testing::GoldenProfile();
  const Tile tile = RandomTile({2, -5, 77}, profile, 42);
  const Bytes base = EncodeTile(tile, profile).blob;
  const Bytes target = EncodeTile(Touched(tile), profile).blob;
  const Bytes delta = EncodeTileDelta(base, target).value();
  const Bytes golden = testing::GoldenFile("tile_delta_v2.bin", delta);
  EXPECT_EQ(ApplyTileDelta(base, golden).value(), target);
}

}  // namespace
}  // namespace atlas
