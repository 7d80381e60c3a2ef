// How far around the vehicle the finest tiles are followed where the store has no room for all of
// a disc: half as far whenever it had none; each coarser level twice as far. So what is fetched for
// a place never drives out what is needed there, and a vehicle that stands still is sent nothing
// twice. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/map_area.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"

namespace atlas {

// The levels from `finest_level` on, as far as the disc goes.
struct DiscPart {
  DiscArea disc;
  std::uint8_t finest_level = 0;
};

class FineReach {
 public:
  // What to follow of a disc from `finest_level` on, coarse first: the disc itself, alone as long
  // as there was always room. The smaller ones stay where they are until the vehicle moved by a
  // quarter of the smallest radius: what lies at their edges does not come and go.
  std::vector<DiscPart> PartsOf(const DiscArea& disc,
                                std::uint8_t finest_level,
                                const MapProfile& profile);
  // There was no room for these parts, in a store that holds so many tiles now.
  void NoteNoRoom(const std::vector<DiscPart>& parts, std::size_t held);
  // There was, they have so many tiles. Twice as far again once the vehicle is elsewhere (a radius
  // of the disc off) and that would be about half of what the store can hold.
  void NoteRoom(const std::vector<DiscPart>& parts, std::size_t tiles);

 private:
  double reach_m_ = std::numeric_limits<double>::infinity();  // of level 0
  Eigen::Vector2d middle_m_ = Eigen::Vector2d::Zero();        // of the smaller discs
  Eigen::Vector2d had_no_room_m_ = Eigen::Vector2d::Zero();   // the last time
  std::size_t most_held_ = 0;                                 // then
};

// Whether a tile, which touches the largest of the parts, is to be followed.
bool IsFollowed(const std::vector<DiscPart>& parts, const TileId& id, const MapProfile& profile);

}  // namespace atlas
