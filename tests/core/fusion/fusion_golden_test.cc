// Promise 1 across compilers: the payloads of random drives are what they were, byte for byte, or
// the rules have another number, by which a daemon knows that its atlas is to be fused again. The
// dev, asan and tsan builds run this, and deploy/compilers.sh g++ and clang++ at -O0 and -O3.
#include <array>
#include <cstdint>

#include <gtest/gtest.h>

#include "core/base/bytes.h"
#include "core/base/str_cat.h"
#include "core/fusion/tile_fusion.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_pyramid.h"
#include "tests/core/fusion/random_drives.h"
#include "tests/core/support/golden.h"

namespace atlas {
namespace {

constexpr std::uint32_t kDrives = 24;

std::uint64_t HashOf(const Tile& tile, const MapProfile& profile) {
  return tile.is_empty() ? 0 : EncodeTile(tile, profile).payload_hash;
}

// Of each drive in each preset: four tiles and their parent.
Bytes PayloadHashes() {
  ByteWriter out;
  for (std::uint32_t seed = 0; seed < kDrives; ++seed) {
    for (const FusionPreset preset :
         {FusionPreset::kPaper, FusionPreset::kStrict, FusionPreset::kBounded}) {
      MapProfile profile = testing::DrivesProfile(seed);
      profile.preset = preset;
      const auto drives = testing::RandomDrives(profile, seed);
      std::array<Tile, 4> tiles;
      std::array<const Tile*, 4> children{};
      const auto ids = TileId{1, 0, 0}.Children();
      for (std::size_t i = 0; i < ids.size(); ++i) {
        tiles[i] = FuseTile(ids[i], drives, profile);
        children[i] = &tiles[i];
        out.U64(HashOf(tiles[i], profile));
      }
      out.U64(HashOf(BuildParentTile({1, 0, 0}, children, profile), profile));
    }
  }
  return out.Take();
}

TEST(FusionGoldenTest, PayloadsAreTheSameEverywhere) {
  const Bytes hashes = PayloadHashes();
  EXPECT_EQ(hashes, testing::GoldenFile(StrCat("fusion_payloads_v", kFusionRules, ".bin"), hashes));
}

}  // namespace
}  // namespace atlas
