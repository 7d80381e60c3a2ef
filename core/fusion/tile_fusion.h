// Keyframes and their poses to a level-0 tile: pure, integer-only (paper III-C, III-D).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/base/status.h"
#include "core/fusion/observation/frame_on_map.h"
#include "core/keyframe/keyframe.h"
#include "core/tile/tile.h"

namespace atlas {

// Of this fusion and of the pyramid above it: another number whenever the same keyframes give
// another payload, so that an atlas knows that it is of another version (decision 0308).
inline constexpr std::uint64_t kFusionRules = 5;

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
