// Which tiles a placed keyframe can change.
#include <algorithm>

#include "core/base/integer_math.h"
#include "core/fusion/observation/disc.h"
#include "core/fusion/observation/keyframe_placement.h"

namespace atlas {

std::vector<TileId> FootprintTiles(const KeyframePlacement& placement,
                                   const GridGeometry& grid,
                                   const MapProfile& profile) {
  const Disc disc = FootprintDisc(placement, grid);
  const std::int64_t side_um = std::int64_t{profile.cell_size_um} * profile.tile_cells;
  const std::int64_t last_y = FloorDiv(disc.y_um + disc.radius_um, side_um);
  const std::int64_t last_x = FloorDiv(disc.x_um + disc.radius_um, side_um);
  std::vector<TileId> tiles;
  for (std::int64_t y = FloorDiv(disc.y_um - disc.radius_um, side_um); y <= last_y; ++y) {
    for (std::int64_t x = FloorDiv(disc.x_um - disc.radius_um, side_um); x <= last_x; ++x) {
      const TileId id{0, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)};
      if (Touches(disc, TileSquare(id, profile))) {
        tiles.push_back(id);
      }
    }
  }
  std::sort(tiles.begin(), tiles.end(),
            [](const TileId& a, const TileId& b) { return a.Key() < b.Key(); });
  return tiles;
}

}  // namespace atlas
