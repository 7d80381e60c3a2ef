#include "client/vehicle/eviction_order.h"

#include <algorithm>

namespace atlas {

EvictionOrder::EvictionOrder(std::uint8_t levels)
    : first_coarse_(static_cast<std::uint8_t>((levels + 1) / 2)),
      ranks_(1U + levels - first_coarse_) {}

LruList<TileId>& EvictionOrder::RankOf(const TileId& id) {
  const std::size_t rank = id.level < first_coarse_ ? 0 : 1U + id.level - first_coarse_;
  return ranks_[std::min(rank, ranks_.size() - 1)];
}

void EvictionOrder::Insert(const TileId& id, std::size_t bytes) {
  RankOf(id).Insert(id.Key(), id, bytes);
}

void EvictionOrder::Use(const TileId& id) {
  RankOf(id).Use(id.Key());
}

void EvictionOrder::Remove(const TileId& id) {
  RankOf(id).Take(id.Key());
}

std::optional<TileId> EvictionOrder::TakeAbove(std::size_t max_bytes) {
  if (bytes() <= max_bytes) return std::nullopt;
  for (LruList<TileId>& rank : ranks_) {
    if (auto oldest = rank.TakeOldestAbove(0)) return oldest;
  }
  return std::nullopt;
}

std::optional<TileId> EvictionOrder::TakeCoarse(
    const std::function<bool(const TileId&)>& is_wanted) {
  for (std::size_t rank = 1; rank < ranks_.size(); ++rank) {
    if (auto oldest = ranks_[rank].TakeOldest(is_wanted)) return oldest;
  }
  return std::nullopt;
}

std::size_t EvictionOrder::bytes() const {
  std::size_t sum = 0;
  for (const LruList<TileId>& rank : ranks_) {
    sum += rank.bytes();
  }
  return sum;
}

}  // namespace atlas
