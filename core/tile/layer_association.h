// Which altitudes belong to one layer of a cell: the paper's eq. 1 (III-C) with the gates of preset
// strict. Fusion chains representatives with it, the pyramid the layers of four child cells.
#pragma once

#include <cstdint>
#include <span>

#include "core/geometry/map_profile.h"

namespace atlas {

struct AltitudeEstimate {
  std::int32_t altitude_mm = 0;
  std::uint32_t sigma_100um = 1;  // standard deviation, units of 0.1 mm, > 0
};

// OLR(a, b) > 0.6: whether the mixture of two equally weighted Gaussians has no saddle, or one
// higher than 0.6 of its smaller peak. Integers only; the threshold is within 0.1 % of the true
// one.
bool OverlapsAsOneLayer(const AltitudeEstimate& a, const AltitudeEstimate& b);

// Labels estimates sorted by altitude with 0, 1, ...: neighbours share a label when eq. 1 and the
// profile's gates say so. `labels` is as long as `sorted`. Returns the number of labels.
std::uint32_t ChainLayers(std::span<const AltitudeEstimate> sorted,
                          const MapProfile& profile,
                          std::span<std::uint32_t> labels);

}  // namespace atlas
