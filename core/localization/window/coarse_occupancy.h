// What stands around a vehicle, at arm's length.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/localization/window/map_window.h"

namespace atlas {

// Of a map window; structure is widened by one block either way.
class CoarseOccupancy {
 public:
  CoarseOccupancy(const MapWindow& map, float block_m);

  // Whether structure stands within a block of `p` (window frame) at its height.
  bool IsOccupied(const Eigen::Vector3f& p) const;

 private:
  float block_m_;
  float segment_height_m_;
  std::int32_t side_;
  std::vector<std::uint64_t> masks_;
};

}  // namespace atlas
