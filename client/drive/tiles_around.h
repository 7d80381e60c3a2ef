// The tiles that a localizer asks for, out of a map view.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "client/map/map_view.h"
#include "core/base/status.h"
#include "core/localization/window/local_map.h"
#include "core/tile/tile.h"

namespace atlas {

// Level-0 tiles that touch the square of `radius_m` around a place, as the localizer's TilesAround.
// Fails as the view does.
Result<std::vector<std::shared_ptr<const Tile>>> TilesAroundPlace(MapView& view,
                                                                  const Eigen::Vector3d& center,
                                                                  double radius_m);

// The same as what a localizer takes; the view outlives it.
TilesAround TilesOf(MapView& view);

}  // namespace atlas
