// A disc of the map and the tiles that it touches, in integers; hostile numbers are harmless.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/integer_math.h"
#include "core/geometry/map_profile.h"
#include "server/store/store_types.h"

namespace atlas {

struct RegionDisc {
  std::int64_t x_um = 0;
  std::int64_t y_um = 0;
  std::uint64_t radius_um = 0;
};

// The same within the world, of which nothing lies beyond: what the others below take.
RegionDisc ClampedToWorld(const RegionDisc& disc);

// All tiles of a level that the disc touches, and a few more.
TileRect RectAround(const RegionDisc& disc, std::uint8_t level, const MapProfile& profile);

// From the disc's centre to the tile's, squared, in square micrometres; nullopt when the disc does
// not touch the tile.
std::optional<Int128> SquaredDistance(const RegionDisc& disc,
                                      const TileId& id,
                                      const MapProfile& profile);

}  // namespace atlas
