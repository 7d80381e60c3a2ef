// What fusion is given of a keyframe: where it lies on the map, and on demand its cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "core/base/status.h"
#include "core/fusion/observation/keyframe_placement.h"
#include "core/geometry/grid_geometry.h"
#include "core/geometry/keyframe_key.h"
#include "core/keyframe/keyframe.h"

namespace atlas {

// A keyframe on the map, without its cells.
struct FrameOnMap {
  KeyframeKey key;
  std::int64_t time_ms = 0;
  KeyframePlacement placement;
  GridGeometry grid;
  std::uint64_t content = 0;  // names the cells: equal for equal keys means the same keyframe
};

// The cells of frame `index`, whose grid is what the frame says; asked for one at a time.
using KeyframeSource = std::function<Result<std::shared_ptr<const Keyframe>>(std::size_t index)>;

}  // namespace atlas
