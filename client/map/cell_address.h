// From a place in the world to the tile and the cell that hold it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"

namespace atlas {

struct CellAddress {
  TileId tile;
  std::size_t cell = 0;  // row-major within the tile

  friend bool operator==(const CellAddress&, const CellAddress&) = default;
};

// The cell of `level` that holds (x, y); borders belong to the cell above them. kInvalidArgument
// when the level or the place is outside of what tiles can name.
Result<CellAddress> LocateCell(const Eigen::Vector2d& p_m,
                               std::uint8_t level,
                               const MapProfile& profile);

double TileSideMetres(std::uint8_t level, const MapProfile& profile);
// World coordinates of the tile's middle.
Eigen::Vector2d TileCenter(const TileId& id, const MapProfile& profile);

// The tiles of `level` that a disc touches, row by row. kInvalidArgument when they are more than
// `max_tiles`.
Result<std::vector<TileId>> TilesInDisc(const Eigen::Vector2d& center_m,
                                        double radius_m,
                                        std::uint8_t level,
                                        const MapProfile& profile,
                                        std::size_t max_tiles);

}  // namespace atlas
