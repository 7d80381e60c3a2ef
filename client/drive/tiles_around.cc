#include "client/drive/tiles_around.h"

#include <cstdint>
#include <numbers>
#include <utility>

#include "client/map/cell_address.h"

namespace atlas {

Result<std::vector<std::shared_ptr<const Tile>>> TilesAroundPlace(MapView& view,
                                                                  const Eigen::Vector3d& center,
                                                                  double radius_m) {
  const double reach_m = radius_m * std::numbers::sqrt2;  // the square's corners
  const Eigen::Vector2d place = center.head<2>();
  if (Status status = view.Load(place, reach_m, 0); !status.ok()) return Error(std::move(status));
  const auto ids = TilesInDisc(place, reach_m, 0, view.profile(), SIZE_MAX);
  if (!ids) return Error(ids.error());
  std::vector<std::shared_ptr<const Tile>> tiles;
  for (const TileId& id : *ids) {
    auto tile = view.Get(id);
    if (!tile) return Error(tile.error());
    if (*tile != nullptr) tiles.push_back(*std::move(tile));
  }
  return tiles;
}

TilesAround TilesOf(MapView& view) {
  return [&view](const Eigen::Vector3d& center, double radius_m) {
    return TilesAroundPlace(view, center, radius_m);
  };
}

}  // namespace atlas
