// An area as the tiles within one square of the map see it: of a way with many legs only the few
// that can touch them, or be the nearest. What it says is what the area says, to the last bit.
#pragma once

#include <vector>

#include "core/geometry/tile_id.h"
#include "server/service/sync/sync_area.h"

namespace atlas {

class LocalArea {
 public:
  // Of the square of 2^bits tiles a side whose lower tile is `corner`. The area outlives this.
  LocalArea(const SyncArea& area, const TileId& corner, int bits);

  // As of the area, for every tile within the square, of whatever level.
  bool Touches(const TileId& id) const;
  double Distance(const TileId& id) const;
  // No tile within the square is nearer, and neither one within nor one around it farther off;
  // metres.
  double least_m() const { return nearest_.empty() ? 0.0 : nearest_[0].least_m; }
  double most_m() const { return most_m_; }

 private:
  struct NearLeg {
    double least_m = 0.0;  // how far off it is for any tile in the square, at least
    const SyncArea::Leg* leg = nullptr;
  };

  void ChooseTouching(const MapSquare& square);
  void ChooseNearest(const MapSquare& square);

  const SyncArea& area_;
  bool is_all_inside_ = false;
  std::vector<const SyncArea::Leg*> touching_;  // where not all is inside, and they make the area
  std::vector<NearLeg> nearest_;                // the least first
  double most_m_ = 0.0;
};

}  // namespace atlas
