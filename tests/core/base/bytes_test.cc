#include "core/base/bytes.h"

#include <cstdint>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(BytesTest, FixedNumbersAreLittleEndian) {
  ByteWriter out;
  out.U16(0x0102);
  out.U32(0x03040506);
  out.I16(-2);
  EXPECT_EQ(out.bytes(), (Bytes{0x02, 0x01, 0x06, 0x05, 0x04, 0x03, 0xFE, 0xFF}));
}

TEST(BytesTest, GoldenVarints) {
  ByteWriter out;
  out.Varint(0);
  out.Varint(127);
  out.Varint(128);
  out.SignedVarint(-1);
  out.SignedVarint(64);
  EXPECT_EQ(out.bytes(), (Bytes{0x00, 0x7F, 0x80, 0x01, 0x01, 0x80, 0x01}));
}

TEST(BytesTest, EverythingWrittenReadsBack) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 2'000; ++i) {
    const std::uint64_t value = random() >> (random() % 64);
    const auto signed_value = static_cast<std::int64_t>(value);
    ByteWriter out;
    out.Varint(value);
    out.SignedVarint(signed_value);
    out.SignedVarint(-signed_value);
    out.I64(signed_value);
    out.I32(static_cast<std::int32_t>(value));
    ByteReader in(out.bytes());
    EXPECT_EQ(in.Varint(), value);
    EXPECT_EQ(in.SignedVarint(), signed_value);
    EXPECT_EQ(in.SignedVarint(), -signed_value);
    EXPECT_EQ(in.I64(), signed_value);
    EXPECT_EQ(in.I32(), static_cast<std::int32_t>(value));
    EXPECT_TRUE(in.ok());
    EXPECT_EQ(in.remaining(), 0u);
  }
}

TEST(BytesTest, SignedVarintHoldsTheExtremes) {
  for (const std::int64_t value :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    ByteWriter out;
    out.SignedVarint(value);
    EXPECT_EQ(ByteReader(out.bytes()).SignedVarint(), value);
  }
}

TEST(BytesTest, ReadingPastTheEndFailsForGood) {
  const Bytes bytes{1, 2, 3};
  ByteReader in(bytes);
  EXPECT_EQ(in.U32(), 0u);
  EXPECT_FALSE(in.ok());
  EXPECT_EQ(in.U8(), 0u);
  EXPECT_FALSE(in.ok());
}

TEST(BytesTest, RefusesVarintsBeyond64Bits) {
  Bytes bytes(9, 0xFF);
  bytes.push_back(0x02);
  ByteReader in(bytes);
  in.Varint();
  EXPECT_FALSE(in.ok());
  const Bytes endless(64, 0x80);
  ByteReader in_endless(endless);
  in_endless.Varint();
  EXPECT_FALSE(in_endless.ok());
}

TEST(BytesTest, StringsAreCapped) {
  ByteWriter out;
  out.String("garage");
  ByteReader in(out.bytes());
  EXPECT_EQ(in.String(6), "garage");
  ByteReader capped(out.bytes());
  EXPECT_EQ(capped.String(5), "");
  EXPECT_FALSE(capped.ok());
}

}  // namespace
}  // namespace atlas
