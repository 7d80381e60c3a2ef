#include "tests/bench/localization/memory_map.h"

#include <utility>

#include "client/map/cell_address.h"
#include "core/tile/tile_codec.h"

namespace atlas::testing {

void MemoryMap::Add(const Tile& tile) {
  EncodedTile encoded = EncodeTile(tile, profile_);
  tiles_.push_back({tile.id, 1, encoded.payload_hash, std::move(encoded.blob)});
}

Status MemoryMap::ReadLevel(std::uint8_t level,
                            const std::optional<DiscArea>& disc,
                            const OnTile& on_tile) {
  if (level != 0) return {};
  const double side_m = TileSideMetres(0, profile_);
  for (const TileBlob& tile : tiles_) {
    const bool is_near =
        !disc || (TileCenter(tile.id, profile_) - disc->center_m).norm() < disc->radius_m + side_m;
    if (is_near) ATLAS_RETURN_IF_ERROR(on_tile(tile));
  }
  return {};
}

std::uint64_t MemoryMap::blob_bytes() const {
  std::uint64_t bytes = 0;
  for (const TileBlob& tile : tiles_) bytes += tile.blob.size();
  return bytes;
}

}  // namespace atlas::testing
