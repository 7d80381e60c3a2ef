// What a client says that it holds: tiles with the hash of their content, or blocks of tiles with
// one digest for all of them, where they are many.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/tile/tile_container.h"
#include "server/store/tile_block.h"

namespace atlas {

struct HeldTile {
  std::uint64_t key = 0;
  std::uint64_t payload_hash = 0;
  SectionMask sections = kAllSections;
  std::size_t number = 0;  // in the order in which they were told
};

struct HeldBlock {
  std::uint64_t block = 0;
  std::uint64_t tiles = 0;   // which of them are held, the first in the lowest bit
  std::uint64_t digest = 0;  // a HeldDigest of these
  SectionMask sections = kAllSections;
  std::size_t number = 0;
};

// Whether these tiles, all that there are of its block, are what is held of it.
bool IsSame(const HeldBlock& held, std::span<const TileSummary> tiles);

// Hash64 over key and payload hash of each, in key order, little-endian.
class HeldDigest {
 public:
  void Add(std::uint64_t key, std::uint64_t payload_hash);
  std::uint64_t value() const;

 private:
  Bytes bytes_;
};

class HeldTiles {
 public:
  static constexpr std::size_t kMaxTiles = 65'536;
  static constexpr std::size_t kMaxBlocks = 65'536;

  HeldTiles() = default;
  // In any order; they are numbered. kInvalidArgument: too many, one twice, a tile whose block is
  // there, too, a key that no tile has.
  static Result<HeldTiles> Create(std::vector<HeldTile> tiles, std::vector<HeldBlock> blocks);

  // In key order.
  const std::vector<HeldTile>& tiles() const { return tiles_; }
  const std::vector<HeldBlock>& blocks() const { return blocks_; }
  // Null: not held, or as part of a block.
  const HeldTile* Find(std::uint64_t key) const;
  const HeldBlock* FindBlock(std::uint64_t block) const;
  // Drops the others; numbers anew.
  void KeepOnly(const std::vector<bool>& tiles, const std::vector<bool>& blocks);
  // That it occupies.
  std::size_t bytes() const {
    return tiles_.capacity() * sizeof(HeldTile) + blocks_.capacity() * sizeof(HeldBlock);
  }

 private:
  std::vector<HeldTile> tiles_;
  std::vector<HeldBlock> blocks_;
};

}  // namespace atlas
