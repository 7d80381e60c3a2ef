// A route drawn over a picture of the map.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "client/render/image.h"
#include "client/render/map_raster.h"

namespace atlas {

// Lines between the points, world frame, over a picture whose map begins `margin_px` from the left
// and the top and shows `box`; discs at both ends. What lies beyond the picture is left out.
void DrawRoute(const std::vector<Eigen::Vector3d>& points,
               const PixelBox& box,
               double metres_per_pixel,
               std::int64_t margin_px,
               Image& image);

}  // namespace atlas
