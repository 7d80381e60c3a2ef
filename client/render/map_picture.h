// A raster of the map as a picture that people look at, and the choice of its resolution.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "client/render/image.h"
#include "client/render/map_raster.h"
#include "client/render/mark_overlay.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

enum class MapColor {
  kHeight,     // altitude, hill-shaded, obstacles dark
  kOccupancy,  // light: free, red: obstacle
  kLayers,     // how many surfaces lie above each other
  kColumns,    // how high what stands on the surface reaches
};

// "height", "occupancy", "layers" or "columns".
Result<MapColor> ParseMapColor(const std::string& text);

struct RenderOptions {
  LayerChoice layer;
  MapColor color = MapColor::kHeight;
  std::int64_t max_side_px = 4096;
  std::int64_t margin_px = 12;
  bool has_scale_bar = true;
  std::vector<Eigen::Vector3d> route;  // drawn over the map, world frame; may be empty
  std::vector<MapMark> marks;          // likewise, below the route
};

struct MapPicture {
  Image image;
  double metres_per_pixel = 0.0;
};

// The part of the raster that is not blank, the margin and the scale bar; north up.
Image DrawPicture(const MapRaster& raster, const RenderOptions& options, double metres_per_pixel);

// Hands every tile of a level to the callback.
using TileCallback = std::function<Status(const Tile&)>;
using LevelReader = std::function<Status(std::uint8_t level, const TileCallback& on_tile)>;

// The finest pyramid level whose picture is at most `max_side_px` a side. Reads levels from the
// coarsest on, each at most once. kNotFound when there is nothing to draw.
Result<MapPicture> RenderMap(const LevelReader& read_level,
                             const RenderOptions& options,
                             const MapProfile& profile);

}  // namespace atlas
