// The map window around a vehicle: renewed as it drives, wider where its place is uncertain.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/status.h"
#include "core/localization/window/coarse_occupancy.h"
#include "core/localization/window/map_window.h"

namespace atlas {

// The tiles that touch the square of `radius_m` around a place: of level 0, and where one is not
// there (yet), coarser ones over it.
using TilesAround = std::function<Result<std::vector<std::shared_ptr<const Tile>>>(
    const Eigen::Vector3d& center, double radius_m)>;

struct LocalMapOptions {
  PlaceOptions window;
  double margin_m = 12.0;       // beyond what is asked for; the window is renewed half-way
  float coarse_block_m = 0.8F;  // of coarse()
};

class LocalMap {
 public:
  LocalMap(const MapProfile& profile, TilesAround tiles, const LocalMapOptions& options);

  // Makes window() hold `radius_m` around `center`. Errors are those of the tiles' source; the
  // window stays then.
  Status Renew(const Eigen::Vector3d& center, double radius_m);
  // The next Renew() asks for tiles wherever it is: others may have come.
  void Expire() { radius_m_ = -1.0; }

  // Both require Renew().
  const MapWindow& window() const { return window_; }
  const CoarseOccupancy& coarse();  // made when first asked for

 private:
  TilesAround tiles_;
  LocalMapOptions options_;
  MapWindow window_;
  std::optional<CoarseOccupancy> coarse_;
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double radius_m_ = -1.0;  // nothing yet
};

}  // namespace atlas
