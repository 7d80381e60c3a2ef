#include "client/vehicle/area_bounds.h"

#include <cmath>
#include <variant>

namespace atlas {
namespace {

constexpr int kBlockSideBits = 3;
constexpr int kBlockBits = 6;
// Places travel as micrometres.
constexpr double kRounding_m = 1e-5;

}  // namespace

AreaBounds::AreaBounds(const MapArea& area, const MapProfile& profile)
    : tile_m_(profile.tile_size_m()) {
  std::visit([this](const auto& shape) { Set(shape); }, area);
  min_m_.array() -= kRounding_m;
  max_m_.array() += kRounding_m;
}

void AreaBounds::Set(const DiscArea& disc) {
  min_m_ = disc.center_m.array() - disc.radius_m;
  max_m_ = disc.center_m.array() + disc.radius_m;
}

void AreaBounds::Set(const BoxArea& box) {
  min_m_ = box.min_m;
  max_m_ = box.max_m;
}

void AreaBounds::Set(const CorridorArea& corridor) {
  if (corridor.route_m.empty()) return;
  min_m_ = max_m_ = corridor.route_m.front();
  for (const Eigen::Vector2d& point_m : corridor.route_m) {
    min_m_ = min_m_.cwiseMin(point_m);
    max_m_ = max_m_.cwiseMax(point_m);
  }
  min_m_.array() -= corridor.half_width_m;
  max_m_.array() += corridor.half_width_m;
}

void AreaBounds::Set(const TilesArea& tiles) {
  for (const TileId& id : tiles.ids) {
    const double side_m = std::ldexp(tile_m_, id.level);
    const Eigen::Vector2d low = side_m * Eigen::Vector2d(id.x, id.y);
    const Eigen::Vector2d high = low.array() + side_m;
    min_m_ = blocks_.empty() ? low : min_m_.cwiseMin(low).eval();
    max_m_ = blocks_.empty() ? high : max_m_.cwiseMax(high).eval();
    blocks_.insert(id.Key() >> kBlockBits);
  }
}

bool AreaBounds::MayTouchBlock(const TileId& id) const {
  if (!blocks_.empty()) return blocks_.contains(id.Key() >> kBlockBits);
  const double side_m = std::ldexp(tile_m_, id.level + kBlockSideBits);
  const Eigen::Vector2d low =
      side_m * Eigen::Vector2d(id.x >> kBlockSideBits, id.y >> kBlockSideBits);
  const Eigen::Vector2d high = low.array() + side_m;
  return (low.array() <= max_m_.array()).all() && (high.array() >= min_m_.array()).all();
}

}  // namespace atlas
