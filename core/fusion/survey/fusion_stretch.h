// The keyframes of one tile in canonical order (vehicle, session, sequence), cut into stretches.
// Whatever order they were given in is gone from here on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/observation/frame_on_map.h"

namespace atlas {

// The keyframes of one session whose sequence / stretch_keyframes is `number`; in preset paper all
// of the session's.
struct FusionStretch {
  const SessionKey* key = nullptr;
  std::uint32_t session = 0;  // equal for equal keys, rising
  std::uint32_t vehicle = 0;  // equal for equal vehicle names, rising
  std::uint32_t number = 0;
  std::vector<std::size_t> frames;  // indices of the frames given, by sequence
};

std::uint32_t StretchNumber(const KeyframeKey& key, const MapProfile& profile);

// The stretches of the frames that touch the tile. `frames` must outlive the result.
std::vector<FusionStretch> CutStretches(const TileId& id,
                                        std::span<const FrameOnMap> frames,
                                        const MapProfile& profile);

}  // namespace atlas
