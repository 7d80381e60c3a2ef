#include "client/map/arena.h"

#include <cstdint>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

struct Piece {
  unsigned char* data;
  std::size_t bytes;
  unsigned char mark;
};

TEST(ArenaTest, PiecesAreAlignedAndApart) {
  std::mt19937 random(1);
  Arena arena;
  std::vector<Piece> pieces;
  for (int i = 0; i < 2'000; ++i) {
    const std::size_t alignment = std::size_t{1} << random() % 8;
    const std::size_t bytes = i % 200 == 0 ? 9'000'000 : 1 + random() % 40'000;
    auto* data = static_cast<unsigned char*>(arena.allocate(bytes, alignment));
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(data) % alignment, 0U);
    const auto mark = static_cast<unsigned char>(random());
    std::memset(data, mark, bytes);
    pieces.push_back({data, bytes, mark});
  }
  for (const Piece& piece : pieces) {
    EXPECT_EQ(piece.data[0], piece.mark);
    EXPECT_EQ(std::memcmp(piece.data, piece.data + 1, piece.bytes - 1), 0) << piece.bytes;
  }
}

TEST(ArenaTest, AVectorInItGrowsAndMovesWithItsContent) {
  Arena arena;
  std::pmr::vector<std::uint64_t> numbers(&arena);
  for (std::uint64_t i = 0; i < 3'000'000; ++i) numbers.push_back(i);
  const std::pmr::vector<std::uint64_t> moved = std::move(numbers);
  for (std::uint64_t i = 0; i < moved.size(); ++i) ASSERT_EQ(moved[i], i);
}

}  // namespace
}  // namespace atlas
