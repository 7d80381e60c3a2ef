// Where a vehicle is when it asks: places along a driven path, evenly spaced.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"

namespace atlas::testing {

// Of the sensor, from the first pose on, every `spacing_m` along the way from pose to pose. Errors
// are those of reading the file.
Result<std::vector<Eigen::Vector3d>> PlacesAlong(const std::filesystem::path& poses,
                                                 double spacing_m);

}  // namespace atlas::testing
