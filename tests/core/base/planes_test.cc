#include "core/base/planes.h"

#include <cstdint>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(PlanesTest, ZigzagOrdersByMagnitude) {
  EXPECT_EQ(Zigzag(0), 0u);
  EXPECT_EQ(Zigzag(-1), 1u);
  EXPECT_EQ(Zigzag(1), 2u);
  EXPECT_EQ(Zigzag(std::numeric_limits<std::int32_t>::min()), 0xFFFFFFFFu);
  for (const std::int32_t value : {0, 1, -1, 77, -77, std::numeric_limits<std::int32_t>::min(),
                                   std::numeric_limits<std::int32_t>::max()}) {
    EXPECT_EQ(Unzigzag(Zigzag(value)), value);
  }
}

TEST(PlanesTest, AllLayoutsReadBackAtEveryLength) {
  std::mt19937 random(2);
  for (std::size_t count = 0; count < 40; ++count) {
    std::vector<std::uint32_t> values(count);
    Bytes nibbles(count);
    Bytes bits(count);
    std::vector<std::uint64_t> words(count);
    for (std::size_t i = 0; i < count; ++i) {
      values[i] = static_cast<std::uint32_t>(random()) >> 8;
      nibbles[i] = random() & 15;
      bits[i] = random() & 1;
      words[i] = random() & 0xFFF;
    }
    ByteWriter out;
    WritePlanes(values, 3, out);
    WriteNibbles(nibbles, out);
    WriteBits(bits, out);
    WriteNibblePlanes(words, 3, out);
    ByteReader in(out.bytes());
    EXPECT_EQ(ReadPlanes(in, count, 3), values);
    EXPECT_EQ(ReadNibbles(in, count), nibbles);
    EXPECT_EQ(ReadBits(in, count), bits);
    std::vector<std::uint64_t> read(count);
    ReadNibblePlanes(in, 3, read);
    EXPECT_EQ(read, words);
    EXPECT_TRUE(in.ok());
    EXPECT_EQ(in.remaining(), 0u);
  }
}

TEST(PlanesTest, GoldenLayouts) {
  ByteWriter out;
  WritePlanes(std::vector<std::uint32_t>{0x0102, 0x0304}, 2, out);
  WriteNibbles(Bytes{1, 2, 3}, out);
  WriteBits(Bytes{1, 0, 1}, out);
  WriteNibblePlanes(std::vector<std::uint64_t>{0x21, 0x43}, 2, out);
  EXPECT_EQ(out.bytes(), (Bytes{0x02, 0x04, 0x01, 0x03, 0x21, 0x03, 0x05, 0x31, 0x42}));
}

TEST(PlanesTest, RefusesNonZeroPadding) {
  const Bytes bytes{0xF1};
  ByteReader nibbles(bytes);
  ReadNibbles(nibbles, 1);
  EXPECT_FALSE(nibbles.ok());
  ByteReader bits(bytes);
  ReadBits(bits, 1);
  EXPECT_FALSE(bits.ok());
  ByteReader planes(bytes);
  std::vector<std::uint64_t> word(1);
  ReadNibblePlanes(planes, 1, word);
  EXPECT_FALSE(planes.ok());
}

TEST(PlanesTest, RefusesMissingBytes) {
  const Bytes bytes{1, 2, 3};
  ByteReader planes(bytes);
  EXPECT_TRUE(ReadPlanes(planes, 2, 2).empty());
  EXPECT_FALSE(planes.ok());
  ByteReader nibbles(bytes);
  EXPECT_TRUE(ReadNibbles(nibbles, 7).empty());
  EXPECT_FALSE(nibbles.ok());
}

}  // namespace
}  // namespace atlas
