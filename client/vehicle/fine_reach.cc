#include "client/vehicle/fine_reach.h"

#include <algorithm>
#include <cmath>

#include "client/vehicle/area_touch.h"

namespace atlas {
namespace {

// Twice as far is twice as many tiles along a road, and four times as many where they are all
// around.
constexpr double kLeastGrowth = 2.0;
constexpr double kMostGrowth = 4.0;
// One level more is about as many tiles as each of those that are followed already.
constexpr double kGrowthOfALevel = 2.0;
// Of a tile's side, on each level the same: a smaller disc may still touch four tiles, as each of
// them does, however small it is.
constexpr double kLeastReach = 0.25;
// Discs are rounded on their way: a tile whose edge is at theirs may be sent. Then it is kept.
constexpr double kRounding_m = 1e-3;

// It goes on as it did up to here.
double GrowthTwiceAsFar(const FollowedBytes& bytes) {
  const double so_far = static_cast<double>(bytes.all) /
                        static_cast<double>(std::max<std::uint64_t>(bytes.inner_half, 1));
  return std::clamp(so_far, kLeastGrowth, kMostGrowth);
}

}  // namespace

std::vector<DiscPart> FineReach::PartsOf(const DiscArea& disc,
                                         std::uint8_t finest_level,
                                         const MapProfile& profile) {
  std::uint8_t level = std::max(finest_level, first_level_);
  double radius_m = std::ldexp(reach_m_, level);
  if ((disc.center_m - middle_m_).norm() > 0.25 * radius_m) middle_m_ = disc.center_m;
  std::vector<DiscPart> parts;
  for (; level + 1 < profile.levels && radius_m < disc.radius_m; ++level, radius_m *= 2.0) {
    parts.push_back({{middle_m_, radius_m}, level});
  }
  parts.push_back({disc, level});
  std::reverse(parts.begin(), parts.end());
  return parts;
}

void FineReach::NoteNoRoom(const std::vector<DiscPart>& parts, const MapProfile& profile) {
  const DiscPart& finest = parts.back();
  middle_m_ = had_no_room_m_ = parts.front().disc.center_m;
  const double reach_m = std::ldexp(finest.disc.radius_m, -finest.finest_level);
  if (reach_m >= kLeastReach * profile.tile_size_m()) {
    reach_m_ = std::min(reach_m_, 0.5 * reach_m);
  } else if (finest.finest_level + 1 < profile.levels) {
    first_level_ = static_cast<std::uint8_t>(finest.finest_level + 1);
  }
}

void FineReach::NoteRoom(const std::vector<DiscPart>& parts, const FollowedBytes& bytes) {
  const DiscArea& disc = parts.front().disc;
  if ((disc.center_m - had_no_room_m_).norm() <= disc.radius_m) return;
  const bool is_level_next = first_level_ > 0 && parts.back().finest_level == first_level_;
  const double growth = is_level_next ? kGrowthOfALevel : GrowthTwiceAsFar(bytes);
  if (growth * static_cast<double>(bytes.all) > static_cast<double>(bytes.room)) return;
  if (is_level_next) {
    --first_level_;
  } else {
    reach_m_ *= 2.0;
  }
}

std::vector<DiscPart> InnerHalf(std::vector<DiscPart> parts) {
  for (DiscPart& part : parts) {
    part.disc.radius_m *= 0.5;
  }
  return parts;
}

bool IsWhole(const std::vector<DiscPart>& parts, std::uint8_t finest_level) {
  return parts.size() == 1 && parts.front().finest_level == finest_level;
}

bool IsFollowed(const std::vector<DiscPart>& parts, const TileId& id, const MapProfile& profile) {
  return std::any_of(parts.begin(), parts.end(), [&](const DiscPart& part) {
    const DiscArea disc{part.disc.center_m, part.disc.radius_m + kRounding_m};
    return id.level >= part.finest_level && Touches(disc, id, profile);
  });
}

}  // namespace atlas
