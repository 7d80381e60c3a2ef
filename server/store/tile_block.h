// Blocks of 8 x 8 tiles of a level whose keys are consecutive: what is asked for, kept and compared
// at a time where tiles are many.
#pragma once

#include <bit>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/store/store_types.h"

namespace atlas {

// The tiles that are there of a block, in key order.
using TileBlock = std::shared_ptr<const std::vector<TileSummary>>;

inline constexpr int kTileBlockSideBits = 3;
inline constexpr std::int32_t kTileBlockSide = 1 << kTileBlockSideBits;
inline constexpr int kTileBlockBits = 2 * kTileBlockSideBits;

// Its number: the keys of its tiles without their lowest six bits.
inline std::uint64_t TileBlockOf(std::uint64_t tile_key) {
  return tile_key >> kTileBlockBits;
}
inline std::uint64_t FirstKeyOf(std::uint64_t block) {
  return block << kTileBlockBits;
}

}  // namespace atlas
