// The disc of a keyframe on the map against squares of the map, in integers.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/fusion/observation/keyframe_placement.h"

namespace atlas {

struct Disc {
  std::int64_t x_um = 0;
  std::int64_t y_um = 0;
  std::int64_t radius_um = 0;
};

struct Square {
  std::int64_t min_x_um = 0;
  std::int64_t min_y_um = 0;
  std::int64_t side_um = 0;
};

inline Disc FootprintDisc(const KeyframePlacement& placement, const GridGeometry& grid) {
  return {placement.x_um, placement.y_um, std::int64_t{grid.radius_cells} * grid.cell_size_um};
}

inline Square TileSquare(const TileId& id, const MapProfile& profile) {
  const std::int64_t side_um = std::int64_t{profile.cell_size_um} * profile.tile_cells;
  return {id.x * side_um, id.y * side_um, side_um};
}

// Whether they have a point in common, borders included.
inline bool Touches(const Disc& disc, const Square& square) {
  const auto outside = [](std::int64_t value, std::int64_t low, std::int64_t high) {
    return std::max({low - value, value - high, std::int64_t{0}});
  };
  const std::int64_t dx = outside(disc.x_um, square.min_x_um, square.min_x_um + square.side_um);
  const std::int64_t dy = outside(disc.y_um, square.min_y_um, square.min_y_um + square.side_um);
  // Radii are at most 1024 m: once both distances are that small, their squares fit.
  return dx <= disc.radius_um && dy <= disc.radius_um &&
         dx * dx + dy * dy <= disc.radius_um * disc.radius_um;
}

}  // namespace atlas
