#include "server/service/region/region_disc.h"

#include <algorithm>

namespace atlas {
namespace {

// Beyond the world: positions are within 10,000 km.
constexpr std::int64_t kMaxExtent_um = 100'000'000'000'000;

std::int64_t Clamped(std::int64_t value) {
  return std::clamp(value, -kMaxExtent_um, kMaxExtent_um);
}

std::int32_t TileCoordinate(std::int64_t position_um, std::int64_t side_um) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(
      FloorDiv(position_um, side_um), TileId::kMinCoordinate, TileId::kMaxCoordinate));
}

// The lower edge of a tile; a coordinate out of this world ends at its border.
std::int64_t Edge(std::int32_t coordinate, std::int64_t side_um) {
  const Int128 edge = Int128{coordinate} * side_um;
  return static_cast<std::int64_t>(
      std::clamp<Int128>(edge, -10 * Int128{kMaxExtent_um}, 10 * Int128{kMaxExtent_um}));
}

// From `position` to the span [first, last]; 0 inside.
std::int64_t Gap(std::int64_t position, std::int64_t first, std::int64_t last) {
  return std::max({first - position, position - last, std::int64_t{0}});
}

Int128 SquaredSum(std::int64_t a, std::int64_t b) {
  return Int128{a} * a + Int128{b} * b;
}

std::int64_t TileSide(std::uint8_t level, const MapProfile& profile) {
  return (std::int64_t{profile.cell_size_um} * profile.tile_cells) << level;
}

}  // namespace

RegionDisc ClampedToWorld(const RegionDisc& disc) {
  return {Clamped(disc.x_um), Clamped(disc.y_um),
          std::min(disc.radius_um, static_cast<std::uint64_t>(kMaxExtent_um))};
}

TileRect RectAround(const RegionDisc& disc, std::uint8_t level, const MapProfile& profile) {
  const std::int64_t side = TileSide(level, profile);
  const auto radius = static_cast<std::int64_t>(disc.radius_um);
  TileRect rect{level};
  rect.min_x = TileCoordinate(disc.x_um - radius, side);
  rect.min_y = TileCoordinate(disc.y_um - radius, side);
  rect.max_x = TileCoordinate(disc.x_um + radius, side);
  rect.max_y = TileCoordinate(disc.y_um + radius, side);
  return rect;
}

std::optional<Int128> SquaredDistance(const RegionDisc& disc,
                                      const TileId& id,
                                      const MapProfile& profile) {
  const std::int64_t side = TileSide(id.level, profile);
  const std::int64_t min_x = Edge(id.x, side);
  const std::int64_t min_y = Edge(id.y, side);
  const Int128 gap =
      SquaredSum(Gap(disc.x_um, min_x, min_x + side), Gap(disc.y_um, min_y, min_y + side));
  const auto radius = static_cast<std::int64_t>(disc.radius_um);
  if (gap > Int128{radius} * radius) {
    return std::nullopt;
  }
  return SquaredSum(min_x + side / 2 - disc.x_um, min_y + side / 2 - disc.y_um);
}

}  // namespace atlas
