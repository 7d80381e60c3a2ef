// A tile's place in the pyramid, and its 64-bit key whose order keeps neighbours together.
#pragma once

#include <array>
#include <cassert>
#include <compare>
#include <cstdint>
#include <iosfwd>

#include "core/base/status.h"

namespace atlas {

// Level 0 is the finest. A tile (l, x, y) covers [x, x+1) x [y, y+1) tile sides of level l in the
// world frame; its parent is (l+1, floor(x/2), floor(y/2)).
struct TileId {
  // x and y fit in 29 bits, biased: +-268 million tiles.
  static constexpr std::int32_t kMaxCoordinate = (1 << 28) - 1;
  static constexpr std::int32_t kMinCoordinate = -(1 << 28);

  std::uint8_t level = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;

  // Frozen: level in bits 58..62, then the Morton code of (x + 2^28, y + 2^28), x in the even bits.
  // Requires coordinates in range. Non-negative as a signed 64-bit integer.
  constexpr std::uint64_t Key() const {
    return (std::uint64_t{level} << kLevelShift) | Spread(Bias(x)) | (Spread(Bias(y)) << 1);
  }
  // kInvalidData on a key that no tile has.
  static Result<TileId> FromKey(std::uint64_t key);

  TileId Parent() const;
  std::array<TileId, 4> Children() const;  // (0,0), (1,0), (0,1), (1,1); requires level > 0

  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 sees a null pointer in <=>
  friend auto operator<=>(const TileId&, const TileId&) = default;

 private:
  static constexpr int kCoordinateBits = 29;
  static constexpr int kLevelShift = 2 * kCoordinateBits;

  static constexpr std::uint64_t Bias(std::int32_t coordinate) {
    assert(coordinate >= kMinCoordinate && coordinate <= kMaxCoordinate);
    return static_cast<std::uint64_t>(coordinate - kMinCoordinate);
  }
  // The low 32 bits over the even bits.
  static constexpr std::uint64_t Spread(std::uint64_t v) {
    v = (v | (v << 16)) & 0x0000FFFF0000FFFFULL;
    v = (v | (v << 8)) & 0x00FF00FF00FF00FFULL;
    v = (v | (v << 4)) & 0x0F0F0F0F0F0F0F0FULL;
    v = (v | (v << 2)) & 0x3333333333333333ULL;
    return (v | (v << 1)) & 0x5555555555555555ULL;
  }
};

// What doubles from level to level, of its size on level 0: exact.
inline double AtLevel(double size, std::uint8_t level) {
  return size * static_cast<double>(std::uint64_t{1} << level);
}

std::ostream& operator<<(std::ostream& out, const TileId& id);  // "0/12/-3"

}  // namespace atlas
