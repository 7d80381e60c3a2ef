// Which tiles an area may be about: a box around it, good enough to leave out what is far away.
// Which it is about: area_touch.h.
#pragma once

#include <cstdint>
#include <set>

#include <Eigen/Core>

#include "client/connection/sync_query.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"

namespace atlas {

class AreaBounds {
 public:
  AreaBounds(const MapArea& area, const MapProfile& profile);

  // True for every tile whose block of 8 x 8 has a tile in the area, and for some others.
  bool MayTouchBlock(const TileId& id) const;
  // The box. Of no tiles and of no route: a box around nothing, at the origin.
  const Eigen::Vector2d& min_m() const { return min_m_; }
  const Eigen::Vector2d& max_m() const { return max_m_; }

 private:
  void Set(const DiscArea& disc);
  void Set(const BoxArea& box);
  void Set(const CorridorArea& corridor);
  void Set(const TilesArea& tiles);

  double tile_m_;
  Eigen::Vector2d min_m_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d max_m_ = Eigen::Vector2d::Zero();
  std::set<std::uint64_t> blocks_;  // where the area is made of tiles
};

}  // namespace atlas
