#include "core/base/hash.h"

#include <algorithm>
#include <cstddef>
#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(HashTest, IsXxh64) {
  EXPECT_EQ(Hash64({}), 0xef46db3751d8e999u);
}

TEST(HashTest, InPiecesIsAsAWhole) {
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    Bytes bytes(random() % 500);
    for (std::uint8_t& byte : bytes) {
      byte = static_cast<std::uint8_t>(random());
    }
    Hash64Stream stream;
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t size = std::min<std::size_t>(random() % 90, bytes.size() - at);
      stream.Add(ByteSpan(bytes).subspan(at, size));
      at += size;
    }
    EXPECT_EQ(stream.value(), Hash64(bytes));
  }
}

TEST(HashTest, ACopyGoesOnByItself) {
  const Bytes start(100, 1);
  Hash64Stream first;
  first.Add(start);
  Hash64Stream second = first;
  second.Add(Bytes(7, 2));
  EXPECT_EQ(first.value(), Hash64(start));
  EXPECT_NE(second.value(), first.value());
}

}  // namespace
}  // namespace atlas
