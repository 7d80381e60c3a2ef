// The part of the map that a sync is about, and where in it its vehicle is and goes: around a
// point, in a box, along a route, or certain tiles. Metres in the world frame; hostile numbers are
// harmless.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/map_area.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"
#include "server/store/store_types.h"

namespace atlas {

class SyncArea {
 public:
  static constexpr std::size_t kMaxRoutePoints = 256;
  static constexpr std::size_t kMaxTiles = 65'536;

  // kInvalidArgument: not finite, a box or a width below nothing, a route without points or with
  // too many, too many tiles or not in key order.
  static Result<SyncArea> Create(MapArea shape, const MapProfile& profile);

  // Squares of 2^bits tiles a side, aligned to their size, are given by their lower tile.
  bool Touches(const TileId& id, int bits = 0) const;
  // All tiles of the level that it touches, and others.
  TileRect Bounds(std::uint8_t level) const;
  // The tiles, where it is made of them.
  const std::vector<TileId>* tiles() const;
  // Of the vehicle and its way.
  std::size_t way_points() const { return way_m_.size(); }
  // How far a tile is from the vehicle and its way, metres; what lies farther along the way counts
  // as farther off. 0 where the area says nothing of a vehicle.
  double Distance(const TileId& id) const;

 private:
  struct Square {
    Eigen::Vector2d min_m;
    Eigen::Vector2d max_m;
  };

  SyncArea(MapArea shape, const MapProfile& profile);
  Square SquareOf(const TileId& id, int bits) const;

  MapArea shape_;
  double tile_m_ = 0.0;                 // side of a level-0 tile
  std::vector<Eigen::Vector2d> way_m_;  // of the vehicle: a point, a route, or nothing
  std::vector<double> along_m_;         // from its beginning to each point
  double reach_m_ = 0.0;                // from it, where it makes the area
};

}  // namespace atlas
