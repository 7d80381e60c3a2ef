#include "server/service/sync/tile_worth.h"

#include "core/geometry/tile_id.h"

namespace atlas {
namespace {

// At this distance from the vehicle and its way a tile counts for an eighth: as much as one of the
// next coarser level does beside it.
constexpr double kNear_m = 20.0;

}  // namespace

double GeometricError(std::uint8_t level, const MapProfile& profile) {
  return AtLevel(profile.cell_size_m(), level);
}

double TileWorth(const MapProfile& profile, std::uint8_t level, double distance_m) {
  const double side_m = AtLevel(profile.tile_size_m(), level);
  const double near = 1.0 + distance_m / kNear_m;
  return GeometricError(level, profile) * (side_m * side_m / (near * near * near));
}

}  // namespace atlas
