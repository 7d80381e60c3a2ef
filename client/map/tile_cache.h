// Decoded tiles in memory, bounded by bytes; the one used longest ago goes first. Also remembers
// where the atlas has no tile. One thread at a time; the tiles themselves are immutable and shared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <unordered_map>

#include "core/tile/tile.h"

namespace atlas {

class TileCache {
 public:
  explicit TileCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // nullopt: not known; null: known not to exist.
  std::optional<std::shared_ptr<const Tile>> Find(const TileId& id);
  bool Contains(const TileId& id) const { return entries_.contains(id.Key()); }
  // `tile` may be null. A tile larger than the cache's bound is not kept.
  void Put(const TileId& id, std::shared_ptr<const Tile> tile);
  void Clear();

  std::size_t size_bytes() const { return size_bytes_; }
  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::uint64_t key = 0;
    std::shared_ptr<const Tile> tile;
    std::size_t size_bytes = 0;
  };

  void Erase(std::uint64_t key);

  std::size_t max_bytes_;
  std::size_t size_bytes_ = 0;
  std::list<Entry> by_use_;  // last used first
  std::unordered_map<std::uint64_t, std::list<Entry>::iterator> entries_;
};

// What a decoded tile takes in memory, near enough.
std::size_t MemoryBytes(const Tile& tile);

}  // namespace atlas
