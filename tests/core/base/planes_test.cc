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

struct Values {
  std::vector<std::uint32_t> planes;
  Bytes nibbles;
  Bytes bits;
  std::vector<std::uint64_t> words;

  friend bool operator==(const Values&, const Values&) = default;
};

Values RandomValues(std::size_t count, std::mt19937& random) {
  Values values;
  for (std::size_t i = 0; i < count; ++i) {
    values.planes.push_back(static_cast<std::uint32_t>(random()) >> 8);
    values.nibbles.push_back(random() & 15);
    values.bits.push_back(random() & 1);
    values.words.push_back(random() & 0xFFF);
  }
  return values;
}

Bytes Write(const Values& values) {
  ByteWriter out;
  WritePlanes(values.planes, 3, out);
  WriteNibbles(values.nibbles, out);
  WriteBits(values.bits, out);
  WriteNibblePlanes(values.words, 3, out);
  return out.Take();
}

Values Read(ByteReader& in, std::size_t count) {
  Values values;
  values.planes = ReadPlanes(in, count, 3);
  values.nibbles = ReadNibbles(in, count);
  values.bits = ReadBits(in, count);
  values.words.resize(count);
  ReadNibblePlanes(in, 3, values.words);
  return values;
}

TEST(PlanesTest, AllLayoutsReadBackAtEveryLength) {
  std::mt19937 random(2);
  for (std::size_t count = 0; count < 40; ++count) {
    const Values values = RandomValues(count, random);
    const Bytes bytes = Write(values);
    ByteReader in(bytes);
    EXPECT_EQ(Read(in, count), values) << count;
    EXPECT_TRUE(in.ok() && in.remaining() == 0) << count;
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
