// What changed, drawn over the map as the later visits saw it: red appeared, blue vanished.
#pragma once

#include <span>

#include <Eigen/Geometry>

#include "client/merge/changes/map_change.h"
#include "client/render/image.h"
#include "client/render/map_raster.h"
#include "core/geometry/map_profile.h"
#include "core/tile/tile.h"

namespace atlas {

class ChangePicture {
 public:
  // Of this part of the world, metres, not empty; as coarse as 2,500 pixels a side need it.
  ChangePicture(const Eigen::AlignedBox2d& part, const MapProfile& profile);

  // Of level 0.
  void Draw(const Tile& tile) { raster_.Draw(tile); }
  // Without what is blank around it.
  Image Finish(std::span<const MapChange> changes) const;

 private:
  double cell_size_m_;
  int shift_;
  MapRaster raster_;
};

}  // namespace atlas
