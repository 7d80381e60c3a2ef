// A part of the map that somebody asks for. Metres in the world frame.
#pragma once

#include <cstddef>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/tile_id.h"

namespace atlas {

struct DiscArea {
  Eigen::Vector2d center_m = Eigen::Vector2d::Zero();
  double radius_m = 0.0;
};
struct BoxArea {
  Eigen::Vector2d min_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d max_m = Eigen::Vector2d::Zero();
};
// Within half a width of a route that begins where the vehicle is, of 1 to kMaxRoutePoints points.
struct CorridorArea {
  static constexpr std::size_t kMaxRoutePoints = 256;

  std::vector<Eigen::Vector2d> route_m;
  double half_width_m = 0.0;
};
struct TilesArea {
  std::vector<TileId> ids;  // each once, at most 65,536
};
using MapArea = std::variant<DiscArea, BoxArea, CorridorArea, TilesArea>;

}  // namespace atlas
