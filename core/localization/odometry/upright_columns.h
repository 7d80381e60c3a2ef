// What stands upright: a ceiling or a floor is seen along rings around the sensor, which move as it
// does, and fit best where it stands still.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace atlas {

// Those of the columns of a scan, or of several in one frame, z up, metres, beside which others are
// higher or lower by 0.4 m.
std::vector<Eigen::Vector3f> UprightColumns(const std::vector<Eigen::Vector3f>& columns);

}  // namespace atlas
