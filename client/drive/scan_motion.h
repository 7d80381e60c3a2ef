// How the sensor of a recorded drive moves during a scan, by the drive's own poses.
#pragma once

#include <cstddef>

#include "core/geometry/pose.h"
#include "core/scan/drive_folder.h"

namespace atlas {

// T_now_later from scan `index` to the one numbered next, or to it from the one before; a jump is
// no motion. Identity, as for a sensor that stands, where it has no neighbour.
Pose MotionDuring(const DriveFolder& drive, std::size_t index);

}  // namespace atlas
