// Where a keyframe's cells lie in the world: from two quantised poses to integers, exactly.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/grid_geometry.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"
#include "core/geometry/tile_id.h"

namespace atlas {

// T_world_level = T_world_sensor * T_level_sensor^-1 as fusion applies it: yaw and translation move
// cells, the residual tilt moves altitudes only.
struct KeyframePlacement {
  static constexpr int kBits = 30;

  std::int64_t x_um = 0;
  std::int64_t y_um = 0;
  std::int64_t z_um = 0;
  std::int32_t cos_yaw = 1 << kBits;  // x 2^30
  std::int32_t sin_yaw = 0;
  std::int32_t slope_x = 0;  // world z per levelled x and y, x 2^30
  std::int32_t slope_y = 0;

  friend bool operator==(const KeyframePlacement&, const KeyframePlacement&) = default;
};

// kInvalidData ("upload again") when the residual tilt is above 2 degrees.
Result<KeyframePlacement> PlaceKeyframe(const QuantizedPose& T_world_sensor,
                                        const std::array<std::int32_t, 4>& level_quaternion);

// The level-0 tiles that the disc of the grid's radius around the placement touches, in key order.
std::vector<TileId> FootprintTiles(const KeyframePlacement& placement,
                                   const GridGeometry& grid,
                                   const MapProfile& profile);

}  // namespace atlas
