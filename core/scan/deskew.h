// Undoes the motion of the vehicle during one revolution of the sensor.
#pragma once

#include "core/geometry/pose.h"
#include "core/scan/leveled_scan.h"
#include "core/scan/range_image.h"

namespace atlas {

// `T_now_later`: how the sensor moves during one revolution, constant velocity. The sensor turns
// clockwise seen from above and its pose is that of the moment it looks ahead (Velodyne; KITTI), so
// a return at azimuth a was measured -a / 2 pi of a revolution after it, a in (-pi, pi]. Returns
// move, but stay in the row and sector in which they were measured: rings are told apart before.
void Deskew(RangeImage& image, const Pose& T_now_later);
// Of a scan levelled by `R_level_sensor`: what is left of the motion, where it was deskewed by
// another one.
void Deskew(LeveledScan& scan, const Eigen::Quaterniond& R_level_sensor, const Pose& T_now_later);

}  // namespace atlas
