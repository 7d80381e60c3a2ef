#include "core/geometry/map_profile.h"

#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/support/golden.h"

namespace atlas {
namespace {

MapProfile UnusualProfile() {
  MapProfile profile;
  profile.cell_size_um = 200'000;
  profile.tile_cells = 64;
  profile.column_segments = 16;
  profile.hit_units = 30;
  profile.origin = GeodeticOrigin{49'013'000'000, -8'400'000'000, 115'000};
  return profile;
}

TEST(MapProfileTest, ReadsBack) {
  for (const MapProfile& profile : {MapProfile(), UnusualProfile()}) {
    EXPECT_TRUE(profile.Validate().ok());
    EXPECT_EQ(MapProfile::Decode(profile.Encode()).value(), profile);
  }
}

TEST(MapProfileTest, GoldenFile) {
  EXPECT_EQ(testing::GoldenFile("profile_v1.bin", UnusualProfile().Encode()),
            UnusualProfile().Encode());
}

TEST(MapProfileTest, HashMovesWithEveryByte) {
  const std::uint64_t hash = MapProfile().Hash();
  EXPECT_NE(UnusualProfile().Hash(), hash);
  MapProfile profile;
  profile.slab_margin_mm += 1;
  EXPECT_NE(profile.Hash(), hash);
}

TEST(MapProfileTest, RefusesTruncationTrailingBytesAndNewerVersions) {
  Bytes bytes = UnusualProfile().Encode();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(MapProfile::Decode(ByteSpan(bytes).first(size)).has_value()) << size;
  }
  bytes.push_back(0);
  EXPECT_FALSE(MapProfile::Decode(bytes).has_value());
  bytes.pop_back();
  bytes[0] = 2;
  EXPECT_EQ(MapProfile::Decode(bytes).error().code(), StatusCode::kUnsupported);
}

TEST(MapProfileTest, NamesTheFieldOutOfRange) {
  const std::vector<std::pair<const char*, std::function<void(MapProfile&)>>> cases = {
      {"cell size",
       [](MapProfile& p) {
         p.cell_size_um = 10'000;
       }},
      {"cells per tile",
       [](MapProfile& p) {
         p.tile_cells = 100;
       }},
      {"levels",
       [](MapProfile& p) {
         p.levels = 0;
       }},
      {"column segments",
       [](MapProfile& p) {
         p.column_segments = 7;
       }},
      {"segment height",
       [](MapProfile& p) {
         p.segment_height_mm = 10;
       }},
      {"base offset",
       [](MapProfile& p) {
         p.column_base_offset_mm = 2'001;
       }},
      {"sigma base",
       [](MapProfile& p) {
         p.sigma_base_mm = 0;
       }},
      {"sigma slope",
       [](MapProfile& p) {
         p.sigma_slope_ppm = 600'000;
       }},
      {"overlap",
       [](MapProfile& p) {
         p.overlap_permille = 500;
       }},
      {"same-layer gate",
       [](MapProfile& p) {
         p.same_layer_mm = 2'000;
       }},
      {"hit",
       [](MapProfile& p) {
         p.hit_units = 0;
       }},
      {"miss",
       [](MapProfile& p) {
         p.miss_units = 1;
       }},
      {"session clamp",
       [](MapProfile& p) {
         p.session_clamp = 128;
       }},
      {"evidence clamp",
       [](MapProfile& p) {
         p.evidence_clamp = 0;
       }},
  };
  for (const auto& [field, damage] : cases) {
    MapProfile profile;
    damage(profile);
    const Status status = profile.Validate();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << field;
    EXPECT_NE(status.message().find(field), std::string::npos) << status.message();
    EXPECT_FALSE(MapProfile::Decode(profile.Encode()).has_value()) << field;
  }
}

}  // namespace
}  // namespace atlas
