// Routes that `atlas plan --output` wrote.
#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"

namespace atlas {

// The waypoints of a GeoJSON Feature's LineString or of a CSV file, by the file's ending, in order;
// metres, map frame. kInvalidData: no such content, or a number that is not finite; else as of
// ReadWholeFile.
Result<std::vector<Eigen::Vector3d>> ReadRoute(const std::filesystem::path& file);

}  // namespace atlas
