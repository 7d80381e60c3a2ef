// Squares drawn over a picture of the map.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "client/render/image.h"
#include "client/render/map_raster.h"

namespace atlas {

struct MapMark {
  Eigen::Vector2d center_m = Eigen::Vector2d::Zero();  // world frame
  double side_m = 0.0;
  Rgb color;
};

// Each at least three pixels wide; as DrawRoute.
void DrawMarks(const std::vector<MapMark>& marks,
               const PixelBox& box,
               double metres_per_pixel,
               std::int64_t margin_px,
               Image& image);

}  // namespace atlas
