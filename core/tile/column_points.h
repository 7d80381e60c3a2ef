// Columns decoded to points (paper III-D): every segment that is called occupied is one, in its
// middle. What the paper localizes with, and what other programs can read.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/map_profile.h"
#include "core/geometry/nibble.h"
#include "core/tile/tile.h"

namespace atlas {

// The paper: 9 to 15 mean an obstacle.
inline constexpr std::uint8_t kNibbleObstacle = kNibbleUnknown + 1;

struct ColumnPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  // middle of cell and segment, metres
  std::uint8_t state = 0;                             // nibble.h

  friend bool operator==(const ColumnPoint&, const ColumnPoint&) = default;
};

// The segments of a tile, of any level, whose state is `min_state` or more: cell by cell as the
// tile has them, in a cell layer by layer and segment by segment upwards.
std::vector<ColumnPoint> DecodeColumns(const Tile& tile,
                                       const MapProfile& profile,
                                       std::uint8_t min_state = kNibbleObstacle);

}  // namespace atlas
