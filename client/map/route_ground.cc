#include "client/map/route_ground.h"

#include <algorithm>
#include <cmath>

#include "client/map/cell_address.h"

namespace atlas {

RouteGround::RouteGround(std::span<const Eigen::Vector3d> route, const MapProfile& profile)
    : route_(route), profile_(profile), flags_(route.size(), 0) {}

void RouteGround::BeginLevel(std::uint8_t level) {
  level_ = level;
  near_m_ = kNear_m + (level == 0 ? 0.0 : 0.5 * profile_.cell_size_m() * std::ldexp(1.0, level));
  std::fill(flags_.begin(), flags_.end(), std::uint8_t{0});
  points_.clear();
  for (std::size_t i = 0; i < route_.size(); ++i) {
    // Beyond what tiles can name there is none.
    const auto address = LocateCell(route_[i].head<2>(), level, profile_);
    if (address) points_[address->tile.Key()].push_back({i, address->cell});
  }
}

void RouteGround::Add(const Tile& tile) {
  if (tile.id.level != level_) BeginLevel(tile.id.level);
  const auto found = points_.find(tile.id.Key());
  if (found == points_.end()) return;
  for (const PointInTile& in_tile : found->second) {
    const auto layers = tile.Layers(in_tile.cell);
    const double z_m = route_[in_tile.point].z();
    const bool is_near = std::any_of(layers.begin(), layers.end(), [&](const TileLayer& layer) {
      return std::abs(1e-3 * layer.altitude_mm - z_m) <= near_m_;
    });
    flags_[in_tile.point] |= is_near ? kOnTile | kOnSurface : kOnTile;
  }
}

std::size_t RouteGround::CountOf(std::uint8_t flag) const {
  return static_cast<std::size_t>(std::count_if(
      flags_.begin(), flags_.end(), [flag](std::uint8_t flags) { return (flags & flag) != 0; }));
}

}  // namespace atlas
