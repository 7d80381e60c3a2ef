// How far around the vehicle the finest tiles are followed where the store has no room for all of
// a disc: half as far whenever it had none; each coarser level twice as far. Where that would be
// next to nothing, the finest level is given up, and so the next. So what is fetched for a place
// never drives out what is needed there, and a vehicle that stands still is sent nothing twice. Not
// thread-safe.
#pragma once

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

// What is held of parts, and what there is room for.
struct FollowedBytes {
  std::uint64_t all = 0;
  std::uint64_t inner_half = 0;  // within half of each part's radius
  std::uint64_t room = 0;
};

class FineReach {
 public:
  // What to follow of a disc from `finest_level` on, coarse first: the disc itself, alone as long
  // as there was always room. The smaller ones stay where they are until the vehicle moved by a
  // quarter of the smallest radius: what lies at their edges does not come and go.
  std::vector<DiscPart> PartsOf(const DiscArea& disc,
                                std::uint8_t finest_level,
                                const MapProfile& profile);
  // There was no room for these parts. The coarsest level is followed all the same.
  void NoteNoRoom(const std::vector<DiscPart>& parts, const MapProfile& profile);
  // There was, and so much of it. Elsewhere (a radius of the disc off) what was given up last comes
  // back where it may fit: a level, or else twice as far.
  void NoteRoom(const std::vector<DiscPart>& parts, const FollowedBytes& bytes);

 private:
  double reach_m_ = std::numeric_limits<double>::infinity();  // of level 0
  std::uint8_t first_level_ = 0;                              // finer ones are given up
  Eigen::Vector2d middle_m_ = Eigen::Vector2d::Zero();        // of the smaller discs
  Eigen::Vector2d had_no_room_m_ = Eigen::Vector2d::Zero();   // the last time
};

// The same parts with half of each radius.
std::vector<DiscPart> InnerHalf(std::vector<DiscPart> parts);
// Whether all of the disc was to be followed, from `finest_level` on.
bool IsWhole(const std::vector<DiscPart>& parts, std::uint8_t finest_level);
// Whether a tile is to be followed.
bool IsFollowed(const std::vector<DiscPart>& parts, const TileId& id, const MapProfile& profile);

}  // namespace atlas
