// Undoes the motion of the vehicle during one revolution of the sensor.
#pragma once

#include "core/geometry/pose.h"
#include "core/scan/point_cloud.h"

namespace atlas {

// `T_now_later`: how the sensor moves during one revolution, constant velocity. The sensor turns
// clockwise seen from above and its pose is that of the moment it looks ahead (Velodyne; KITTI), so
// a return at azimuth a was measured -a / 2 pi of a revolution after it, a in (-pi, pi].
PointCloud Deskew(const PointCloud& cloud, const Pose& T_now_later);

}  // namespace atlas
