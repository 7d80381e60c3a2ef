// Preset bounded: of each band of altitude in a cell, only the segments that were seen last count,
// so that what a cell costs does not grow with the passes.
#pragma once

#include <vector>

#include "core/fusion/segment_view.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// Removes what does not count: latest first, a segment counts while its band holds fewer than
// `band_segments`, and fewer than `band_vehicle_segments` of its vehicle. The order is kept.
void KeepLatestSegments(const MapProfile& profile, std::vector<SegmentView>& segments);

}  // namespace atlas
