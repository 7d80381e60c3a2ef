#include "server/service/sync/touched_tiles.h"

#include <utility>

#include "server/service/sync/local_area.h"
#include "server/store/tile_block.h"

namespace atlas {

static_assert(kTileBlockBits == 6, "a word has a bit for each tile of a block");

TouchedTiles::TouchedTiles(SyncArea area, std::uint32_t finest_level, std::uint32_t coarsest_level)
    : area_(std::move(area)), finest_level_(finest_level) {
  for (std::uint32_t level = finest_level; level <= coarsest_level; ++level) {
    bounds_.push_back(area_.Bounds(static_cast<std::uint8_t>(level)));
  }
}

bool TouchedTiles::Has(const TileId& id) {
  if (id.level < finest_level_ || id.level - finest_level_ >= bounds_.size() ||
      !bounds_[id.level - finest_level_].Contains(id)) {
    return false;
  }
  const std::uint64_t key = id.Key();
  const std::uint64_t block = TileBlockOf(key);
  auto found = touched_.find(block);
  if (found == touched_.end()) {
    if (touched_.size() >= kMaxBlocks) {
      touched_.clear();
    }
    found = touched_.emplace(block, TouchedOf(block)).first;
    ++compared_blocks_;
  }
  return (found->second >> (key - FirstKeyOf(block)) & 1) != 0;
}

std::uint64_t TouchedTiles::TouchedOf(std::uint64_t block) const {
  const TileId corner =
      TileId::FromKey(FirstKeyOf(block)).value();  // a tile of the block has a key
  if (!area_.Touches(corner, kTileBlockSideBits)) {
    return 0;
  }
  const LocalArea local(area_, corner, kTileBlockSideBits);
  std::uint64_t touched = 0;
  for (std::uint64_t i = 0; i < std::uint64_t{1} << kTileBlockBits; ++i) {
    const TileId id = TileId::FromKey(FirstKeyOf(block) + i).value();
    touched |= std::uint64_t{local.Touches(id)} << i;
  }
  return touched;
}

}  // namespace atlas
