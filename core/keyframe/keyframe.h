// One LiDAR scan as a gravity-levelled local grid (paper III-B, III-D): what a vehicle uploads and
// fusion reads. It never holds the pose: that comes beside it and may be corrected later.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/grid_geometry.h"
#include "core/geometry/keyframe_cell.h"

namespace atlas {

struct Keyframe {
  static constexpr std::int32_t kMaxRadiusCells = 1024;
  // Column anchors stand per block of this many cells a side, counted from the grid's corner.
  static constexpr std::int32_t kBlockCells = 8;
  static constexpr std::int32_t kMinSensorHeight_mm = 100;
  static constexpr std::int32_t kMaxSensorHeight_mm = 10'000;

  std::uint64_t profile_hash = 0;
  GridGeometry grid;
  // From the sensor into the grid's frame (GridAttitude), as w x y z, x 2^30: level as an IMU knows
  // it when scanning, turned about the vertical as the vehicle chose.
  std::array<std::int32_t, 4> level_quaternion{1 << 30, 0, 0, 0};
  std::int32_t sensor_height_mm = 0;  // above the ground below the sensor

  std::vector<KeyframeCell> cells;     // grid.size()
  std::vector<std::uint64_t> columns;  // grid.size(): nibbles, lowest segment first; 0 = no data
  // Per block, row-major: the lowest segment of its columns covers
  // [anchor, anchor + 1) * segment_height relative to the sensor.
  std::vector<std::int16_t> anchors;

  std::int32_t blocks_per_side() const { return (grid.side() + kBlockCells - 1) / kBlockCells; }
  std::size_t BlockIndex(std::int32_t ix, std::int32_t iy) const {
    return static_cast<std::size_t>((iy + grid.radius_cells) / kBlockCells) *
               static_cast<std::size_t>(blocks_per_side()) +
           static_cast<std::size_t>((ix + grid.radius_cells) / kBlockCells);
  }

  std::size_t block_count() const {
    return static_cast<std::size_t>(blocks_per_side()) *
           static_cast<std::size_t>(blocks_per_side());
  }

  friend bool operator==(const Keyframe&, const Keyframe&) = default;
};

// The invariants of a keyframe; kInvalidData naming the first one broken:
//  - 1 <= radius_cells <= kMaxRadiusCells, cell size within a map profile's limits;
//  - the level quaternion has length 1 within 1e-6;
//  - kMinSensorHeight_mm <= sensor_height_mm <= kMaxSensorHeight_mm;
//  - cells and columns have grid.size() elements, anchors block_count();
//  - enumerators are in range;
//  - a cell not seen (source kNone) has altitude 0, unknown occupancy and no column.
Status ValidateKeyframe(const Keyframe& keyframe);

// The part of it that holds for what the blob's header says.
Status ValidateKeyframeFrame(const GridGeometry& grid,
                             const std::array<std::int32_t, 4>& level_quaternion,
                             std::int32_t sensor_height_mm);

}  // namespace atlas
