#include "core/geometry/map_profile.h"

#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/hash.h"
#include "tests/core/support/golden.h"
#include "tests/core/support/golden_profile.h"

namespace atlas {
namespace {

using testing::GoldenProfile;

TEST(MapProfileTest, ReadsBack) {
  for (const MapProfile& profile : {MapProfile(), GoldenProfile()}) {
    EXPECT_TRUE(profile.Validate().ok());
    EXPECT_EQ(MapProfile::Decode(profile.Encode()).value(), profile);
  }
}

TEST(MapProfileTest, GoldenFile) {
  const Bytes golden = testing::GoldenFile("profile_v3.bin", GoldenProfile().Encode());
  EXPECT_EQ(MapProfile::Decode(golden).value(), GoldenProfile());
  EXPECT_EQ(GoldenProfile().Encode(), golden);
}

// The golden profile as versions 1 and 2 had it, each before and after its last change.
TEST(MapProfileTest, EarlierEncodingsAreReadAndStayWhatTheyAre) {
  for (const char* name :
       {"profile_v1_first.bin", "profile_v1.bin", "profile_v2_first.bin", "profile_v2.bin"}) {
    SCOPED_TRACE(name);
    const Bytes golden = testing::GoldenFile(name);
    const auto profile = MapProfile::Decode(golden);
    ASSERT_TRUE(profile.has_value()) << profile.error().message();
    EXPECT_EQ(profile->Encode(), golden);
    EXPECT_EQ(profile->Hash(), Hash64(golden));
    MapProfile fields = *profile;
    fields.earlier_encoding.clear();
    MapProfile expected = GoldenProfile();
    if (golden[0] == 1) {
      const MapProfile defaults;
      expected.band_segments = defaults.band_segments;
      expected.band_vehicle_segments = defaults.band_vehicle_segments;
    }
    EXPECT_EQ(fields, expected);
    EXPECT_NE(*profile, expected) << "blobs that name one do not name the other";
  }
}

TEST(MapProfileTest, EarlierRangesAreBroughtIntoTodays) {
  const auto decode = [](const std::vector<std::pair<std::size_t, std::int16_t>>& changes) {
    Bytes bytes = testing::GoldenFile("profile_v1.bin");
    for (const auto& [offset, value] : changes) {
      bytes[offset] = static_cast<std::uint8_t>(value & 0xff);
      bytes[offset + 1] = static_cast<std::uint8_t>(value >> 8);
    }
    return MapProfile::Decode(bytes);
  };
  constexpr std::size_t kOverlap = 26;
  constexpr std::size_t kStretchClamp = 42;
  constexpr std::size_t kEvidenceClamp = 44;
  constexpr std::size_t kDrivenClamp = 46;
  const auto profile =
      decode({{kOverlap, 700}, {kStretchClamp, 100}, {kEvidenceClamp, 20}, {kDrivenClamp, 16'384}});
  ASSERT_TRUE(profile.has_value()) << profile.error().message();
  EXPECT_EQ(profile->overlap_permille, 600);
  EXPECT_EQ(profile->stretch_clamp, 64);
  EXPECT_EQ(profile->evidence_clamp, 64);
  EXPECT_EQ(profile->driven_clamp, 127);
  for (const auto& [offset, value] : {std::pair<std::size_t, std::int16_t>{kOverlap, 951},
                                      {kStretchClamp, 0},
                                      {kEvidenceClamp, 128},
                                      {kDrivenClamp, 63}}) {
    EXPECT_EQ(decode({{offset, value}}).error().code(), StatusCode::kInvalidData) << offset;
  }
}

TEST(MapProfileTest, HashMovesWithEveryByte) {
  const std::uint64_t hash = MapProfile().Hash();
  EXPECT_NE(GoldenProfile().Hash(), hash);
  MapProfile profile;
  profile.slab_margin_mm += 1;
  EXPECT_NE(profile.Hash(), hash);
}

TEST(MapProfileTest, RefusesTruncationTrailingBytesAndUnknownVersions) {
  for (Bytes bytes :
       {GoldenProfile().Encode(), testing::GoldenFile("profile_v2.bin"),
        testing::GoldenFile("profile_v1.bin"), testing::GoldenFile("profile_v1_first.bin")}) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      EXPECT_FALSE(MapProfile::Decode(ByteSpan(bytes).first(size)).has_value()) << size;
    }
    bytes.push_back(0);
    EXPECT_FALSE(MapProfile::Decode(bytes).has_value());
    bytes.pop_back();
    for (const int version : {0, 4}) {
      bytes[0] = static_cast<std::uint8_t>(version);
      EXPECT_EQ(MapProfile::Decode(bytes).error().code(), StatusCode::kUnsupported);
    }
  }
}

TEST(MapProfileTest, HasOneEncoding) {
  Bytes bytes = GoldenProfile().Encode();
  constexpr std::size_t kOriginBytes = 3 * 8;
  bytes[bytes.size() - kOriginBytes - 1] = 2;  // has_origin: as good as 1, but other bytes
  EXPECT_EQ(MapProfile::Decode(bytes).error().code(), StatusCode::kInvalidData);
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
      {"keyframes per stretch",
       [](MapProfile& p) {
         p.stretch_keyframes = 8;
       }},
      {"height of a band",
       [](MapProfile& p) {
         p.band_mm = 100;
       }},
      {"segments of a band",
       [](MapProfile& p) {
         p.band_segments = 0;
       }},
      {"a vehicle's segments",
       [](MapProfile& p) {
         p.band_vehicle_segments = 0;
       }},
      {"stretch clamp",
       [](MapProfile& p) {
         p.stretch_clamp = 128;
       }},
      {"hold where a vehicle drove",
       [](MapProfile& p) {
         p.driven_hold_ms = 3'600'001;
       }},
      {"carry clamp",
       [](MapProfile& p) {
         p.carry_clamp = 65;
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
