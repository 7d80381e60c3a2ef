#include "client/map/tile_cache.h"

namespace atlas {
namespace {

constexpr std::size_t kEntryBytes = 128;  // list and map nodes

}  // namespace

std::size_t MemoryBytes(const Tile& tile) {
  return sizeof(Tile) + tile.layers.capacity() * sizeof(TileLayer) +
         tile.cell_begin.capacity() * sizeof(std::uint32_t) +
         tile.contributors.capacity() * sizeof(SessionKey);
}

std::optional<std::shared_ptr<const Tile>> TileCache::Find(const TileId& id) {
  const auto found = entries_.find(id.Key());
  if (found == entries_.end()) return std::nullopt;
  by_use_.splice(by_use_.begin(), by_use_, found->second);
  return found->second->tile;
}

void TileCache::Put(const TileId& id, std::shared_ptr<const Tile> tile) {
  const std::uint64_t key = id.Key();
  Erase(key);
  const std::size_t size = kEntryBytes + (tile == nullptr ? 0 : MemoryBytes(*tile));
  if (size > max_bytes_) return;
  while (size_bytes_ + size > max_bytes_) {
    Erase(by_use_.back().key);
  }
  by_use_.push_front({key, std::move(tile), size});
  entries_[key] = by_use_.begin();
  size_bytes_ += size;
}

void TileCache::Clear() {
  entries_.clear();
  by_use_.clear();
  size_bytes_ = 0;
}

void TileCache::Erase(std::uint64_t key) {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return;
  size_bytes_ -= found->second->size_bytes;
  by_use_.erase(found->second);
  entries_.erase(found);
}

}  // namespace atlas
