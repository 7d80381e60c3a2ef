#include "server/service/sync/held_tiles.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "core/base/hash.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

Status Refuse(const std::string& why) {
  return {StatusCode::kInvalidArgument, StrCat("held tiles: ", why)};
}

template <typename T>
const T* FindIn(const std::vector<T>& sorted, std::uint64_t number, std::uint64_t T::*field) {
  const auto found = std::partition_point(sorted.begin(), sorted.end(),
                                          [&](const T& held) { return held.*field < number; });
  return found != sorted.end() && (*found).*field == number ? &*found : nullptr;
}

// Sorts them, numbered as they came; false: one is there twice.
template <typename T>
bool Sort(std::vector<T>& held, std::uint64_t T::*field) {
  for (std::size_t i = 0; i < held.size(); ++i) {
    held[i].number = i;
  }
  std::sort(held.begin(), held.end(),
            [field](const T& a, const T& b) { return a.*field < b.*field; });
  return std::adjacent_find(held.begin(), held.end(), [field](const T& a, const T& b) {
           return a.*field == b.*field;
         }) == held.end();
}

template <typename T>
void Keep(std::vector<T>& held, const std::vector<bool>& is_kept) {
  std::vector<T> kept;
  kept.reserve(static_cast<std::size_t>(std::count(is_kept.begin(), is_kept.end(), true)));
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (is_kept[i]) {
      kept.push_back(held[i]);
      kept.back().number = kept.size() - 1;
    }
  }
  held = std::move(kept);
}

}  // namespace

void HeldDigest::Add(std::uint64_t key, std::uint64_t payload_hash) {
  for (const std::uint64_t value : {key, payload_hash}) {
    for (int shift = 0; shift < 64; shift += 8) {
      bytes_.push_back(static_cast<std::uint8_t>(value >> shift));
    }
  }
}

std::uint64_t HeldDigest::value() const {
  return Hash64(bytes_);
}

Result<HeldTiles> HeldTiles::Create(std::vector<HeldTile> tiles, std::vector<HeldBlock> blocks) {
  if (tiles.size() > kMaxTiles || blocks.size() > kMaxBlocks) {
    return Error(Refuse(StrCat(tiles.size(), " tiles and ", blocks.size(),
                               " blocks, expected at most ", kMaxTiles, " and ", kMaxBlocks)));
  }
  if (!Sort(tiles, &HeldTile::key) || !Sort(blocks, &HeldBlock::block)) {
    return Error(Refuse("one is there twice"));
  }
  HeldTiles held;
  held.tiles_ = std::move(tiles);
  held.blocks_ = std::move(blocks);
  for (const HeldTile& tile : held.tiles_) {
    if (const auto id = TileId::FromKey(tile.key); !id) {
      return Error(Refuse(id.error().message()));
    }
    if (held.FindBlock(TileBlockOf(tile.key)) != nullptr) {
      return Error(Refuse(StrCat("tile ", TileId::FromKey(tile.key).value(),
                                 " is told by itself, and so is its block")));
    }
  }
  for (const HeldBlock& block : held.blocks_) {
    const bool is_in_range = TileBlockOf(FirstKeyOf(block.block)) == block.block;
    if (!is_in_range || !TileId::FromKey(FirstKeyOf(block.block))) {
      return Error(Refuse(StrCat("block ", block.block, ": there is no such one")));
    }
  }
  return held;
}

void HeldTiles::KeepOnly(const std::vector<bool>& tiles, const std::vector<bool>& blocks) {
  Keep(tiles_, tiles);
  Keep(blocks_, blocks);
}

const HeldTile* HeldTiles::Find(std::uint64_t key) const {
  return FindIn(tiles_, key, &HeldTile::key);
}

const HeldBlock* HeldTiles::FindBlock(std::uint64_t block) const {
  return FindIn(blocks_, block, &HeldBlock::block);
}

bool IsSame(const HeldBlock& held, std::span<const TileSummary> tiles) {
  HeldDigest digest;
  int count = 0;
  for (const TileSummary& tile : tiles) {
    if ((held.tiles >> (tile.id.Key() - FirstKeyOf(held.block)) & 1u) != 0) {
      digest.Add(tile.id.Key(), tile.payload_hash);
      ++count;
    }
  }
  return count == std::popcount(held.tiles) && digest.value() == held.digest;
}

}  // namespace atlas
