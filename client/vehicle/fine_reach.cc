#include "client/vehicle/fine_reach.h"

#include <algorithm>
#include <cmath>

#include "client/vehicle/area_touch.h"

namespace atlas {
namespace {

// Twice as far is up to four times as many tiles of each level, and half of the room is kept.
constexpr std::size_t kRoomToGrow = 8;
// Discs are rounded on their way: a tile whose edge is at theirs may be sent. Then it is kept.
constexpr double kRounding_m = 1e-3;

}  // namespace

std::vector<DiscPart> FineReach::PartsOf(const DiscArea& disc,
                                         std::uint8_t finest_level,
                                         const MapProfile& profile) {
  double radius_m = std::ldexp(reach_m_, finest_level);
  if ((disc.center_m - middle_m_).norm() > 0.25 * radius_m) middle_m_ = disc.center_m;
  std::vector<DiscPart> parts;
  std::uint8_t level = finest_level;
  for (; level + 1 < profile.levels && radius_m < disc.radius_m; ++level, radius_m *= 2.0) {
    parts.push_back({{middle_m_, radius_m}, level});
  }
  parts.push_back({disc, level});
  std::reverse(parts.begin(), parts.end());
  return parts;
}

void FineReach::NoteNoRoom(const std::vector<DiscPart>& parts, std::size_t held) {
  const DiscPart& finest = parts.back();
  reach_m_ = 0.5 * std::ldexp(finest.disc.radius_m, -finest.finest_level);
  middle_m_ = had_no_room_m_ = parts.front().disc.center_m;
  most_held_ = held;
}

void FineReach::NoteRoom(const std::vector<DiscPart>& parts, std::size_t tiles) {
  const DiscArea& disc = parts.front().disc;
  if (parts.size() == 1 || (disc.center_m - had_no_room_m_).norm() <= disc.radius_m) return;
  if (tiles * kRoomToGrow > most_held_) return;
  reach_m_ *= 2.0;
  had_no_room_m_ = disc.center_m;
}

bool IsFollowed(const std::vector<DiscPart>& parts, const TileId& id, const MapProfile& profile) {
  return std::any_of(parts.begin(), parts.end(), [&](const DiscPart& part) {
    const DiscArea disc{part.disc.center_m, part.disc.radius_m + kRounding_m};
    return id.level >= part.finest_level && Touches(disc, id, profile);
  });
}

}  // namespace atlas
