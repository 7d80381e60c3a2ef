// The local occupancy grid with ground heights of one scan (paper III-B).
#pragma once

#include <span>
#include <vector>

#include "core/geometry/keyframe_cell.h"
#include "core/geometry/vehicle_body.h"
#include "core/grid/ground_profile.h"
#include "core/scan/leveled_scan.h"
#include "core/scan/ray_table.h"

namespace atlas {

struct LocalGrid {
  std::vector<KeyframeCell> cells;  // grid.size()
};

// Traces the virtual scan: each cell is updated at most once, hits before misses, and those below
// the vehicle itself, now and along its `trail`, are driven; on the trail its wheels know the
// ground where no return does. Free cells between ground returns get an interpolated altitude;
// cells beyond an obstacle that a return or a ray above reached stay unknown and get the altitude
// of the nearest ground on the ray.
LocalGrid BuildLocalGrid(const LeveledScan& scan,
                         const RayTable& rays,
                         const VehicleContact& contact,
                         std::span<const VehiclePlace> trail,
                         const ProfileOptions& options);

}  // namespace atlas
