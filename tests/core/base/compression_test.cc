#include "core/base/compression.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "core/base/hash.h"

namespace atlas {
namespace {

Bytes SomeText() {
  std::mt19937 random(3);
  Bytes bytes(3'000);
  for (auto& byte : bytes) {
    byte = static_cast<std::uint8_t>(random() % 7);
  }
  return bytes;
}

TEST(CompressionTest, RoundTrip) {
  const Bytes text = SomeText();
  const Bytes frame = Compress(text, 3);
  EXPECT_LT(frame.size(), text.size());
  EXPECT_EQ(Decompress(frame, text.size()).value(), text);
  EXPECT_EQ(Decompress(Compress({}, 3), 0).value(), Bytes());
}

TEST(CompressionTest, RefusesAnotherDeclaredSize) {
  const Bytes text = SomeText();
  const Bytes frame = Compress(text, 3);
  const auto result = Decompress(frame, text.size() + 1);
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code(), StatusCode::kInvalidData);
}

// 64 MiB in a few KB: what it says first decides, whether it is true or not.
TEST(CompressionTest, ABombIsNoLargerThanItWasMeantToBe) {
  constexpr std::uint32_t kBombBytes = 64u << 20;
  constexpr std::uint32_t kExpectedBytes = 1'000;
  Bytes bomb = Compress(Bytes(kBombBytes), 3);
  ASSERT_LT(bomb.size(), 16u << 10);
  EXPECT_EQ(Decompress(bomb, kExpectedBytes).error().code(), StatusCode::kInvalidData);
  // The content size, 4 bytes behind magic, descriptor and window (RFC 8878, 3.1.1.1).
  ASSERT_EQ(bomb[4] >> 5U, 0b100) << "a size of 4 bytes and a window";
  ByteWriter lie;
  lie.U32(kExpectedBytes);
  std::copy(lie.bytes().begin(), lie.bytes().end(), bomb.begin() + 6);
  EXPECT_EQ(Decompress(bomb, kExpectedBytes).error().code(), StatusCode::kInvalidData);
}

TEST(CompressionTest, RefusesTruncationAndTrailingBytes) {
  const Bytes text = SomeText();
  Bytes frame = Compress(text, 3);
  for (std::size_t size = 0; size < frame.size(); ++size) {
    EXPECT_FALSE(Decompress(ByteSpan(frame).first(size), text.size()).has_value()) << size;
  }
  frame.push_back(0);
  EXPECT_FALSE(Decompress(frame, text.size()).has_value());
}

TEST(CompressionTest, AFlippedBitNeverChangesTheContent) {
  const Bytes text = SomeText();
  const Bytes frame = Compress(text, 3);
  for (std::size_t bit = 0; bit < 8 * frame.size(); ++bit) {
    Bytes damaged = frame;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    const auto result = Decompress(damaged, text.size());
    EXPECT_TRUE(!result || *result == text) << "bit " << bit;
  }
}

TEST(CompressionTest, WhatIsAlikeTakesNextToNothing) {
  // Further back than a frame of this level looks by itself.
  Bytes prefix(9'000'000);
  std::mt19937 random(5);
  for (auto& byte : prefix) {
    byte = static_cast<std::uint8_t>(random());
  }
  Bytes text(prefix.begin(), prefix.begin() + 100'000);
  text[500] ^= 1U;
  const Bytes frame = CompressAgainst(prefix, text, 3);
  EXPECT_LT(frame.size(), 200u);
  EXPECT_EQ(DecompressAgainst(prefix, frame, text.size()).value(), text);
  EXPECT_FALSE(DecompressAgainst({}, frame, text.size()).has_value());
  prefix[1'000] ^= 1U;
  EXPECT_FALSE(DecompressAgainst(prefix, frame, text.size()).has_value());
}

TEST(CompressionTest, ADifferenceToNothingIsTheWhole) {
  const Bytes text = SomeText();
  EXPECT_EQ(Decompress(CompressAgainst({}, text, 3), text.size()).value(), text);
  EXPECT_EQ(DecompressAgainst(text, CompressAgainst(text, {}, 3), 0).value(), Bytes());
}

TEST(HashTest, GoldenValuesOfXxh64) {
  EXPECT_EQ(Hash64({}), 0xEF46DB3751D8E999ULL);
  const Bytes abc{'a', 'b', 'c'};
  EXPECT_EQ(Hash64(abc), 0x44BC2CF5AD770999ULL);
}

}  // namespace
}  // namespace atlas
