#include "server/store/tile_directory.h"

#include <utility>

namespace atlas {
namespace {

constexpr std::size_t kBlockBytes =
    160;  // of a block without tiles, its places in the list included

}  // namespace

TileBlock TileDirectory::Find(std::uint64_t block) {
  const std::lock_guard lock(mutex_);
  const TileBlock* found = blocks_.Use(block);
  return found == nullptr ? nullptr : *found;
}

std::uint64_t TileDirectory::Version(std::uint64_t block) const {
  const std::lock_guard lock(mutex_);
  return SlotOf(block).version;
}

void TileDirectory::Insert(std::uint64_t block, std::uint64_t version, TileBlock tiles) {
  const std::lock_guard lock(mutex_);
  const Slot& slot = SlotOf(block);
  if (slot.version != version || slot.changing > 0) {
    return;
  }
  const std::size_t bytes = kBlockBytes + tiles->capacity() * sizeof(TileSummary);
  blocks_.Insert(block, std::move(tiles), bytes);
  while (blocks_.TakeOldestAbove(max_bytes_)) {
  }
}

void TileDirectory::BeginChange(const TileId& id) {
  const std::uint64_t block = TileBlockOf(id.Key());
  const std::lock_guard lock(mutex_);
  Slot& slot = SlotOf(block);
  ++slot.version;
  ++slot.changing;
  blocks_.Take(block);
}

void TileDirectory::EndChange(const TileId& id) {
  const std::lock_guard lock(mutex_);
  Slot& slot = SlotOf(TileBlockOf(id.Key()));
  ++slot.version;
  --slot.changing;
}

std::size_t TileDirectory::bytes() const {
  const std::lock_guard lock(mutex_);
  return blocks_.bytes();
}

}  // namespace atlas
