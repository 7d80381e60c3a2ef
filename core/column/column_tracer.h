// Nibble columns of one scan (paper III-D): every return is traced in 3-D, its own segment is hit,
// the segments its ray passed are missed.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/keyframe_cell.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/vehicle_body.h"
#include "core/scan/leveled_scan.h"
#include "core/scan/ray_table.h"

namespace atlas {

struct LocalColumns {
  std::vector<std::uint64_t> columns;  // grid.size() nibbles, lowest segment first; 0 = no data
  // Per block of `block_cells`, row-major: the lowest segment's index in the levelled frame.
  std::vector<std::int16_t> anchors;
};

struct ColumnOptions {
  int segments = 8;
  float segment_height_m = 1.0F;
  float base_offset_m = 0.3F;  // obstacle returns lower than this above ground make no hit
  std::int32_t block_cells = 8;
  // How far from where it was measured an obstacle may be: kitti_0005, not corrected for motion.
  float blur_m = 0.2F;
  VehicleBody body;

  static ColumnOptions FromProfile(const MapProfile& profile, std::int32_t block_cells);
};

// `cells`: the ground below (LocalGrid); columns stand only where it is known. Ground returns are
// traced too: that is what clears a parked car with nothing behind it. A segment is missed where
// rays passed both its halves, and never where anything was measured in it, ground included, nor
// within `blur_m` of an obstacle in it. Free is where the vehicle itself is
// (`here`, at the grid's middle), or was on its `trail`.
LocalColumns TraceColumns(const LeveledScan& scan,
                          const RayTable& rays,
                          std::span<const KeyframeCell> cells,
                          const VehiclePlace& here,
                          std::span<const VehiclePlace> trail,
                          const ColumnOptions& options);

}  // namespace atlas
