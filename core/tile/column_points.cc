#include "core/tile/column_points.h"

#include <algorithm>
#include <cstddef>

namespace atlas {
namespace {

void DecodeColumn(const TileLayer& layer,
                  const Eigen::Vector2d& middle_m,
                  const MapProfile& profile,
                  std::uint8_t min_state,
                  std::vector<ColumnPoint>& points) {
  const std::int32_t base = ColumnBaseIndex(layer.altitude_mm, profile);
  for (int segment = 0; segment < profile.column_segments; ++segment) {
    const std::uint8_t state = NibbleAt(layer.column, segment);
    if (state < min_state) continue;
    const double z_m = (base + segment + 0.5) * profile.segment_height_m();
    points.push_back({{middle_m.x(), middle_m.y(), z_m}, state});
  }
}

}  // namespace

std::vector<ColumnPoint> DecodeColumns(const Tile& tile,
                                       const MapProfile& profile,
                                       std::uint8_t min_state) {
  const std::uint8_t at_least = std::max<std::uint8_t>(min_state, 1);  // 0 is no data
  const double cell_m = AtLevel(profile.cell_size_m(), tile.id.level);
  const double first_x = static_cast<double>(profile.tile_cells) * tile.id.x + 0.5;
  const double first_y = static_cast<double>(profile.tile_cells) * tile.id.y + 0.5;
  std::vector<ColumnPoint> points;
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    const Eigen::Vector2d middle_m(
        (first_x + static_cast<double>(cell % profile.tile_cells)) * cell_m,
        (first_y + static_cast<double>(cell / profile.tile_cells)) * cell_m);
    for (const TileLayer& layer : tile.Layers(cell)) {
      if (layer.column != 0) DecodeColumn(layer, middle_m, profile, at_least, points);
    }
  }
  return points;
}

}  // namespace atlas
