// Tiles of the finest level in memory, as a source of them; the other levels are empty.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "client/map/map_source.h"
#include "core/geometry/map_profile.h"
#include "core/tile/tile.h"

namespace atlas::testing {

class MemoryMap : public MapSource {
 public:
  explicit MemoryMap(const MapProfile& profile) : profile_(profile) {}

  void Add(const Tile& tile);

  const MapProfile& profile() const override { return profile_; }
  Status ReadLevel(std::uint8_t level,
                   const std::optional<DiscArea>& disc,
                   const OnTile& on_tile) override;

  std::uint64_t blob_bytes() const;

 private:
  MapProfile profile_;
  std::vector<TileBlob> tiles_;
};

}  // namespace atlas::testing
