// The keyframes of one tile in canonical order (vehicle, session, sequence), with everything about
// each that does not depend on the cell. Whatever order they were given in is gone from here on.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/tile_fusion.h"

namespace atlas {

struct FusionFrame {
  const FrameOnMap* placed = nullptr;
  std::size_t index = 0;      // of the frame as it was given
  std::uint32_t session = 0;  // index into FusionInput::sessions
  std::uint32_t sequence = 0;
  std::uint32_t time_rank = 0;  // by (time, vehicle, session, sequence) among the frames
};

struct FusionSession {
  const SessionKey* key = nullptr;
  std::uint32_t vehicle = 0;    // equal for equal vehicle names
  bool is_time_ordered = true;  // time ranks rise with the sequence
};

struct FusionInput {
  std::vector<FusionFrame> frames;
  std::vector<FusionSession> sessions;
  std::int32_t max_radius_cells = 1;
};

// The frames that touch the tile, in canonical order. `frames` must outlive the result.
FusionInput PrepareFusion(const TileId& id,
                          std::span<const FrameOnMap> frames,
                          const MapProfile& profile);

}  // namespace atlas
