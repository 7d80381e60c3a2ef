// Keyframes and their poses to a level-0 tile: pure, integer-only (paper III-C, III-D).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "core/base/status.h"
#include "core/fusion/observation/keyframe_placement.h"
#include "core/geometry/keyframe_key.h"
#include "core/keyframe/keyframe.h"
#include "core/tile/tile.h"

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

// The tile `id` (level 0) from the frames whose footprints touch it, in any order: the result does
// not depend on it. Frames that do not reach the tile are ignored; without an observed cell the
// tile is empty. One keyframe is held at a time, and about `max_bytes` of observations: where that
// is too little for the whole tile it is done in bands, and each asks for its keyframes again.
// Errors are those of the source.
Result<Tile> FuseTile(const TileId& id,
                      std::span<const FrameOnMap> frames,
                      const KeyframeSource& source,
                      const MapProfile& profile,
                      std::size_t max_bytes = std::size_t{128} << 20);

struct PlacedKeyframe {
  KeyframeKey key;
  std::int64_t time_ms = 0;
  KeyframePlacement placement;
  std::shared_ptr<const Keyframe> keyframe;
};

// The same from keyframes in memory.
Tile FuseTile(const TileId& id,
              std::span<const PlacedKeyframe> keyframes,
              const MapProfile& profile);

}  // namespace atlas
