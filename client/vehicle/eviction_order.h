// Which tile goes first when there is no room for all: the one used longest ago, but coarse ones
// only when nothing else is left, the coarsest last. They are few bytes, and without them a vehicle
// that comes back has no map at all. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/base/lru_list.h"
#include "core/geometry/tile_id.h"

namespace atlas {

class EvictionOrder {
 public:
  // The upper half of the pyramid's levels is coarse: about a 200th of the bytes.
  explicit EvictionOrder(std::uint8_t levels);

  // It is the one used last from now on. Replaces what was there.
  void Insert(const TileId& id, std::size_t bytes);
  void Use(const TileId& id);
  void Remove(const TileId& id);
  bool IsCoarse(const TileId& id) const { return id.level >= first_coarse_; }
  // Takes out what goes first, if all together are more than `max_bytes`.
  std::optional<TileId> TakeAbove(std::size_t max_bytes);
  // Takes out the coarse one that goes first of those of which `is_wanted` is true.
  std::optional<TileId> TakeCoarse(const std::function<bool(const TileId&)>& is_wanted);

  std::size_t bytes() const;

 private:
  LruList<TileId>& RankOf(const TileId& id);

  std::uint8_t first_coarse_;
  std::vector<LruList<TileId>> ranks_;  // fine levels together, then one a coarse level
};

}  // namespace atlas
