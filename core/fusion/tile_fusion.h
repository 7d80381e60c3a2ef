// Keyframes and their poses to a level-0 tile: pure, integer-only (paper III-C, III-D).
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/fusion/keyframe_placement.h"
#include "core/geometry/keyframe_key.h"
#include "core/keyframe/keyframe.h"
#include "core/tile/tile.h"

namespace atlas {

struct PlacedKeyframe {
  KeyframeKey key;
  std::int64_t time_ms = 0;
  KeyframePlacement placement;
  std::shared_ptr<const Keyframe> keyframe;
};

// The tile `id` (level 0) from the keyframes whose footprints touch it, in any order: the result
// does not depend on it. Keyframes that do not reach the tile are ignored; without an observed cell
// the tile is empty.
Tile FuseTile(const TileId& id,
              std::span<const PlacedKeyframe> keyframes,
              const MapProfile& profile);

}  // namespace atlas
