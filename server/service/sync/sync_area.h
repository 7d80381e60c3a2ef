// The part of the map that a sync is about, and where in it its vehicle is and goes: around a
// point, in a box, along a route, or certain tiles. Metres in the world frame; hostile numbers are
// harmless.
#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/map_area.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"
#include "server/service/sync/map_square.h"
#include "server/store/store_types.h"

namespace atlas {

class SyncArea {
 public:
  // A straight part of the vehicle's way, or the point where it stands.
  struct Leg {
    Eigen::Vector2d from_m;
    Eigen::Vector2d to_m;
    double along_m = 0.0;  // from the beginning of the way to `from_m`
  };

  static constexpr std::size_t kMaxRoutePoints = CorridorArea::kMaxRoutePoints;
  static constexpr std::size_t kMaxTiles = 65'536;
  // So much more to drive counts as this much farther off.
  static constexpr double kAlongWeight = 0.25;

  // kInvalidArgument: not finite, a box or a width below nothing, a route without points or with
  // too many, too many tiles or not in key order.
  static Result<SyncArea> Create(MapArea shape, const MapProfile& profile);
  // One of these tiles. As above, and for a key that no tile has.
  static Result<SyncArea> OfTiles(std::vector<std::uint64_t> keys, const MapProfile& profile);

  // Squares of 2^bits tiles a side, aligned to their size, are given by their lower tile.
  bool Touches(const TileId& id, int bits = 0) const;
  // All tiles of the level that it touches, and others.
  TileRect Bounds(std::uint8_t level) const;
  // The keys of the tiles, rising, where it is made of them; else null.
  const std::vector<std::uint64_t>* tile_keys() const;
  // That it occupies.
  std::size_t bytes() const;
  // Of all that it was made of: another one for another area.
  std::uint64_t Hash() const;
  // Of the vehicle's way; none where the area says nothing of one.
  const std::vector<Leg>& legs() const { return legs_; }
  // Those that make the area, all within `reach_m` of them; null where something else does.
  const std::vector<Leg>* shaping_legs() const;
  double reach_m() const { return reach_m_; }
  // The same as Touches() by one leg alone.
  bool IsWithinReach(const Leg& leg, const TileId& id, int bits) const;
  double tile_side_m(std::uint8_t level) const;
  // How far a tile is from the vehicle and its way, metres; what lies farther along the way counts
  // as farther off. 0 where the area says nothing of a vehicle.
  double Distance(const TileId& id) const;
  MapSquare SquareOf(const TileId& id, int bits) const;
  // The same by one leg alone, unless that is `best_m` or more: then `best_m`.
  static double Nearer(double best_m, const Leg& leg, const MapSquare& square);

 private:
  struct Tiles {
    std::vector<std::uint64_t> keys;
  };
  using Shape = std::variant<DiscArea, BoxArea, CorridorArea, Tiles>;

  SyncArea(Shape shape, const MapProfile& profile);

  Shape shape_;
  double tile_m_ = 0.0;  // side of a level-0 tile
  std::vector<Leg> legs_;
  double reach_m_ = 0.0;  // from them, where they make the area
};

}  // namespace atlas
