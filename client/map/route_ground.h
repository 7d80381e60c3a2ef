// How a route lies on the tiles of a map: what tells one of another map or of another frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/map_profile.h"
#include "core/tile/tile.h"

namespace atlas {

class RouteGround {
 public:
  // This far above or below a surface a point is on it: less than half of what decks are apart. On
  // coarser levels, whose surfaces are of many cells, half a cell's side more.
  static constexpr double kNear_m = 1.0;

  // `route` in the world frame, metres; it outlives this.
  RouteGround(std::span<const Eigen::Vector3d> route, const MapProfile& profile);

  // All of a level, in any order, then maybe all of a finer one: what that says counts.
  void Add(const Tile& tile);

  // Points that lie on a tile, and those of them that are on a surface of their cell.
  std::size_t on_tiles() const { return CountOf(kOnTile); }
  std::size_t on_surfaces() const { return CountOf(kOnSurface); }
  std::size_t points() const { return route_.size(); }

 private:
  static constexpr std::uint8_t kOnTile = 1;
  static constexpr std::uint8_t kOnSurface = 2;

  struct PointInTile {
    std::size_t point = 0;
    std::size_t cell = 0;
  };

  void BeginLevel(std::uint8_t level);
  std::size_t CountOf(std::uint8_t flag) const;

  std::span<const Eigen::Vector3d> route_;
  MapProfile profile_;
  int level_ = -1;
  double near_m_ = kNear_m;
  std::unordered_map<std::uint64_t, std::vector<PointInTile>> points_;  // by TileId::Key
  std::vector<std::uint8_t> flags_;                                     // of each point
};

}  // namespace atlas
