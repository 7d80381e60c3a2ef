// Which tiles a placed keyframe can change.
#include <algorithm>

#include "core/base/integer_math.h"
#include "core/fusion/keyframe_placement.h"

namespace atlas {
namespace {

struct Disc {
  std::int64_t x_um = 0;
  std::int64_t y_um = 0;
  std::int64_t radius_um = 0;
};

// How far `value` is outside [low, high].
std::int64_t DistanceOutside(std::int64_t value, std::int64_t low, std::int64_t high) {
  return std::max({low - value, value - high, std::int64_t{0}});
}

// Requires a tile no farther than the radius along each axis, so that the squares fit.
bool Touches(const Disc& disc, std::int64_t tile_x, std::int64_t tile_y, std::int64_t side_um) {
  const std::int64_t dx = DistanceOutside(disc.x_um, tile_x * side_um, (tile_x + 1) * side_um);
  const std::int64_t dy = DistanceOutside(disc.y_um, tile_y * side_um, (tile_y + 1) * side_um);
  return dx * dx + dy * dy <= disc.radius_um * disc.radius_um;
}

}  // namespace

std::vector<TileId> FootprintTiles(const KeyframePlacement& placement,
                                   const GridGeometry& grid,
                                   const MapProfile& profile) {
  const Disc disc{placement.x_um, placement.y_um,
                  std::int64_t{grid.radius_cells} * grid.cell_size_um};
  const std::int64_t side_um = std::int64_t{profile.cell_size_um} * profile.tile_cells;
  std::vector<TileId> tiles;
  for (std::int64_t y = FloorDiv(disc.y_um - disc.radius_um, side_um);
       y <= FloorDiv(disc.y_um + disc.radius_um, side_um); ++y) {
    for (std::int64_t x = FloorDiv(disc.x_um - disc.radius_um, side_um);
         x <= FloorDiv(disc.x_um + disc.radius_um, side_um); ++x) {
      if (Touches(disc, x, y, side_um)) {
        tiles.push_back({0, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)});
      }
    }
  }
  std::sort(tiles.begin(), tiles.end(),
            [](const TileId& a, const TileId& b) { return a.Key() < b.Key(); });
  return tiles;
}

}  // namespace atlas
