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
  return versions_[SlotOf(block)];
}

void TileDirectory::Insert(std::uint64_t block, std::uint64_t version, TileBlock tiles) {
  const std::lock_guard lock(mutex_);
  if (versions_[SlotOf(block)] != version) {
    return;
  }
  const std::size_t bytes = kBlockBytes + tiles->capacity() * sizeof(TileSummary);
  blocks_.Insert(block, std::move(tiles), bytes);
  while (blocks_.TakeOldestAbove(max_bytes_)) {
  }
}

void TileDirectory::Forget(const TileId& id) {
  const std::uint64_t block = TileBlockOf(id.Key());
  const std::lock_guard lock(mutex_);
  ++versions_[SlotOf(block)];
  blocks_.Take(block);
}

std::size_t TileDirectory::bytes() const {
  const std::lock_guard lock(mutex_);
  return blocks_.bytes();
}

}  // namespace atlas
