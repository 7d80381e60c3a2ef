#include "core/keyframe/keyframe_codec.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "core/base/hash.h"
#include "core/keyframe/keyframe_body.h"
#include "core/keyframe/keyframe_body_check.h"
#include "tests/core/support/golden.h"
#include "tests/core/support/golden_profile.h"
#include "tests/core/support/keyframe_worlds.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

using testing::BlankKeyframe;
using testing::RandomKeyframe;
using testing::StreetKeyframe;

// Replaces the checksum at the end, so that what lies behind it is tested.
Bytes WithChecksum(Bytes blob) {
  blob.resize(blob.size() - 8);
  ByteWriter out;
  out.Raw(blob);
  out.U64(Hash64(blob));
  return out.Take();
}

StatusCode DecodeError(ByteSpan blob) {
  const auto result = DecodeKeyframe(blob);
  return result ? StatusCode::kOk : result.error().code();
}

TEST(KeyframeCodecTest, RandomKeyframesReadBack) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(60); ++seed) {
    const std::int32_t radius = 1 + static_cast<std::int32_t>(seed % 21);
    MapProfile profile;
    profile.column_segments = static_cast<std::uint8_t>(2u << (seed % 4));
    const Keyframe keyframe = RandomKeyframe(profile, radius, seed);
    ASSERT_TRUE(ValidateKeyframe(keyframe).ok());
    const Bytes blob = EncodeKeyframe(keyframe);
    const auto decoded = DecodeKeyframe(blob);
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message();
    EXPECT_EQ(*decoded, keyframe) << "seed " << seed;
    EXPECT_EQ(EncodeKeyframe(*decoded), blob);
  }
}

TEST(KeyframeCodecTest, ExtremeAltitudesReadBack) {
  Keyframe keyframe = BlankKeyframe(MapProfile(), 2);
  const std::int16_t low = std::numeric_limits<std::int16_t>::min();
  const std::int16_t high = std::numeric_limits<std::int16_t>::max();
  for (std::size_t i = 0; i < keyframe.cells.size(); ++i) {
    keyframe.cells[i] = {i % 2 == 0 ? low : high, Occupancy::kFree, AltitudeSource::kMeasured};
    keyframe.columns[i] = ~std::uint64_t{0};
  }
  keyframe.anchors = {low};
  EXPECT_EQ(DecodeKeyframe(EncodeKeyframe(keyframe)).value(), keyframe);
}

TEST(KeyframeCodecTest, AKeyframeThatSawNothingReadsBack) {
  const Keyframe keyframe = BlankKeyframe(MapProfile(), 200);
  const Bytes blob = EncodeKeyframe(keyframe);
  EXPECT_LT(blob.size(), 200u);
  EXPECT_EQ(DecodeKeyframe(blob).value(), keyframe);
}

TEST(KeyframeCodecTest, HeaderIsReadWithoutTheRest) {
  Keyframe keyframe = StreetKeyframe(MapProfile(), 20, 1);
  keyframe.level_quaternion = {1'073'554'091, 0, 20'077'802, 0};
  const auto header = ReadKeyframeHeader(EncodeKeyframe(keyframe));
  ASSERT_TRUE(header.has_value()) << header.error().message();
  EXPECT_EQ(header->profile_hash, MapProfile().Hash());
  EXPECT_EQ(header->grid, keyframe.grid);
  EXPECT_EQ(header->level_quaternion, keyframe.level_quaternion);
  EXPECT_EQ(header->sensor_height_mm, 1'730);
  EXPECT_TRUE(CheckKeyframeProfile(*header, MapProfile()).ok());
}

TEST(KeyframeCodecTest, RefusesAnotherProfile) {
  const auto header = ReadKeyframeHeader(EncodeKeyframe(BlankKeyframe(MapProfile(), 4)));
  MapProfile other;
  other.slab_margin_mm = 0;
  EXPECT_EQ(CheckKeyframeProfile(*header, other).code(), StatusCode::kInvalidData);
  KeyframeHeader lying = *header;
  lying.grid.cell_size_um = 200'000;
  EXPECT_EQ(CheckKeyframeProfile(lying, MapProfile()).code(), StatusCode::kInvalidData);
}

TEST(KeyframeCodecTest, RefusesTruncationAtEveryByte) {
  const Bytes blob = EncodeKeyframe(RandomKeyframe(MapProfile(), 8, 3));
  for (std::size_t size = 0; size < blob.size(); ++size) {
    EXPECT_EQ(DecodeError(ByteSpan(blob).first(size)), StatusCode::kInvalidData) << size;
  }
}

TEST(KeyframeCodecTest, RefusesEveryFlippedBit) {
  const Bytes blob = EncodeKeyframe(RandomKeyframe(MapProfile(), 6, 4));
  for (std::size_t bit = 0; bit < 8 * blob.size(); ++bit) {
    Bytes damaged = blob;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_NE(DecodeError(damaged), StatusCode::kOk) << "bit " << bit;
  }
}

TEST(KeyframeCodecTest, RefusesTrailingBytes) {
  Bytes blob = EncodeKeyframe(BlankKeyframe(MapProfile(), 4));
  blob.push_back(0);
  EXPECT_EQ(DecodeError(blob), StatusCode::kInvalidData);
  EXPECT_EQ(DecodeError(WithChecksum(blob)), StatusCode::kInvalidData);
}

// A body alone, behind all checksums.
bool BodyIsRefused(ByteSpan body, std::int32_t radius_cells) {
  Keyframe decoded;
  decoded.grid = {MapProfile().cell_size_um, radius_cells};
  return DecodeKeyframeBody(body, decoded).code() == StatusCode::kInvalidData;
}

TEST(KeyframeCodecTest, RefusesBodiesOfTheWrongLength) {
  Bytes body = EncodeKeyframeBody(RandomKeyframe(MapProfile(), 8, 5));
  EXPECT_FALSE(BodyIsRefused(body, 8));
  EXPECT_TRUE(BodyIsRefused({}, 8));
  EXPECT_TRUE(BodyIsRefused(ByteSpan(body).first(body.size() - 1), 8));
  body.push_back(0);
  EXPECT_TRUE(BodyIsRefused(body, 8));
}

TEST(KeyframeCodecTest, RefusesStatesThatNoCellHas) {
  Bytes body = EncodeKeyframeBody(RandomKeyframe(MapProfile(), 8, 5));
  body[0] = 0x0C;  // driven, but not seen
  EXPECT_TRUE(BodyIsRefused(body, 8));
  body[0] = 0x04;  // free, but not seen
  EXPECT_TRUE(BodyIsRefused(body, 8));
}

// Bodies with one byte changed, in every way that one byte can be wrong.
TEST(KeyframeCodecTest, ACheckTakesExactlyWhatIsDecoded) {
  std::mt19937 random(3);
  std::size_t taken = 0;
  std::size_t refused = 0;
  for (std::uint32_t seed = 0; seed < testing::Scaled(40); ++seed) {
    MapProfile profile;
    profile.column_segments = static_cast<std::uint8_t>(2u << (seed % 4));
    const Keyframe keyframe =
        RandomKeyframe(profile, 1 + static_cast<std::int32_t>(seed % 9), seed);
    const Bytes body = EncodeKeyframeBody(keyframe);
    for (int change = 0; change < 200; ++change) {
      Bytes changed = body;
      changed[random() % changed.size()] =
          static_cast<std::uint8_t>(random() % 3 == 0 ? 0 : random());
      changed.resize(change % 20 == 0 ? random() % body.size() : body.size());
      Keyframe decoded;
      decoded.grid = keyframe.grid;
      const bool is_valid = DecodeKeyframeBody(changed, decoded).ok();
      ASSERT_EQ(IsKeyframeBody(changed, keyframe.grid, decoded.block_count()), is_valid)
          << "seed " << seed << ", change " << change;
      (is_valid ? taken : refused) += 1;
    }
  }
  const std::size_t few = (taken + refused) / 8;
  EXPECT_GT(taken, few);
  EXPECT_GT(refused, few);
}

TEST(KeyframeCodecTest, ACheckOfABlobSaysWhatDecodingSays) {
  const Bytes blob = EncodeKeyframe(StreetKeyframe(MapProfile(), 12, 7));
  EXPECT_EQ(CheckKeyframe(blob)->grid, DecodeKeyframe(blob)->grid);
  for (std::size_t i = 0; i < blob.size(); ++i) {
    Bytes flipped = blob;
    flipped[i] ^= 1;
    for (const Bytes& bad : {flipped, WithChecksum(flipped)}) {
      const auto decoded = DecodeKeyframe(bad);
      const auto checked = CheckKeyframe(bad);
      ASSERT_EQ(checked.has_value(), decoded.has_value()) << "byte " << i;
      if (!decoded) {
        EXPECT_EQ(checked.error().message(), decoded.error().message());
      }
    }
  }
}

TEST(KeyframeCodecTest, SaysThatANewerVersionIsUnsupported) {
  Bytes blob = EncodeKeyframe(BlankKeyframe(MapProfile(), 4));
  blob[4] = 2;
  EXPECT_EQ(DecodeError(blob), StatusCode::kUnsupported);
  EXPECT_EQ(ReadKeyframeHeader(blob).error().code(), StatusCode::kUnsupported);
}

// Headers that lie, with a checksum that fits: offsets of docs/formats/keyframe.md.
TEST(KeyframeCodecTest, RefusesLyingHeaders) {
  const Bytes blob = EncodeKeyframe(BlankKeyframe(MapProfile(), 4));
  ASSERT_EQ(DecodeError(WithChecksum(blob)), StatusCode::kOk);
  struct Lie {
    const char* about;
    std::size_t offset;
    unsigned value;  // of 16 bits
  };
  for (const Lie& lie :
       {Lie{"radius 0", 17, 0}, Lie{"radius 1025", 17, 1'025}, Lie{"another radius", 17, 5},
        Lie{"65 m cells", 15, 1'000}, Lie{"a short quaternion", 21, 0},
        Lie{"a sensor 9.9 cm up", 35, 99}, Lie{"a sensor 10.001 m up", 35, 10'001},
        Lie{"a sensor 2 km below the ground", 37, 0xFFE0}, Lie{"a huge body", 41, 0xFFFF}}) {
    Bytes bad = blob;
    bad[lie.offset] = static_cast<std::uint8_t>(lie.value);
    bad[lie.offset + 1] = static_cast<std::uint8_t>(lie.value >> 8);
    EXPECT_EQ(DecodeError(WithChecksum(bad)), StatusCode::kInvalidData) << lie.about;
  }
}

TEST(KeyframeCodecTest, SensorHeightsThatABuilderTakesReadBack) {
  for (const std::int32_t height_mm : {100, 10'000}) {
    Keyframe keyframe = BlankKeyframe(MapProfile(), 4);
    keyframe.sensor_height_mm = height_mm;
    const auto decoded = DecodeKeyframe(EncodeKeyframe(keyframe));
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message();
    EXPECT_EQ(decoded->sensor_height_mm, height_mm);
  }
}

TEST(KeyframeCodecTest, ValidateNamesWhatIsWrong) {
  Keyframe keyframe = BlankKeyframe(MapProfile(), 4);
  keyframe.columns[5] = 1;
  EXPECT_NE(ValidateKeyframe(keyframe).message().find("cell 5"), std::string::npos);
  keyframe = BlankKeyframe(MapProfile(), 4);
  keyframe.cells[6].altitude_mm = 1;
  EXPECT_FALSE(ValidateKeyframe(keyframe).ok());
  keyframe = BlankKeyframe(MapProfile(), 4);
  keyframe.cells[6].source = static_cast<AltitudeSource>(4);
  EXPECT_FALSE(ValidateKeyframe(keyframe).ok());
  keyframe = BlankKeyframe(MapProfile(), 4);
  keyframe.anchors.push_back(0);
  EXPECT_FALSE(ValidateKeyframe(keyframe).ok());
  keyframe = BlankKeyframe(MapProfile(), 4);
  keyframe.sensor_height_mm = -1;
  EXPECT_NE(ValidateKeyframe(keyframe).message().find("-1 mm"), std::string::npos);
}

TEST(KeyframeCodecTest, GoldenFileReadsAndEncodesEqual) {
  const Keyframe keyframe = RandomKeyframe(testing::GoldenProfile(), 6, 42);
  const Bytes golden = testing::GoldenFile("keyframe_v1.bin", EncodeKeyframe(keyframe));
  const auto decoded = DecodeKeyframe(golden);
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message();
  EXPECT_EQ(*decoded, keyframe);
  EXPECT_EQ(EncodeKeyframe(*decoded), golden);
}

}  // namespace
}  // namespace atlas
