// What a tile is to be made of after its keyframes changed, stretch by stretch, and how much of
// what was surveyed of each stays true.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/fusion/observation/frame_on_map.h"
#include "core/fusion/observation/keyframe_placement.h"
#include "core/geometry/keyframe_key.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"

namespace atlas {

// How the keyframes that touch a tile differ from those that it was made of last. Each is known by
// its `content`, which is its own.
struct TileChange {
  std::vector<FrameOnMap> present;    // new ones, and those that lie otherwise than before
  std::vector<std::uint64_t> absent;  // contents of those that are gone, or were never there
};

// A frame of a stretch, without its session.
struct StretchMember {
  std::uint32_t sequence = 0;
  std::int32_t radius_cells = 0;
  std::int64_t time_ms = 0;
  std::uint64_t content = 0;
  KeyframePlacement placement;

  friend bool operator==(const StretchMember&, const StretchMember&) = default;
};

struct PlannedStretch {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  SessionKey key;
  std::uint32_t number = 0;
  std::vector<StretchMember> frames;  // by sequence
  std::uint32_t old = kNone;          // the caller's number of its survey, if that can go on
  std::size_t kept = 0;               // of `frames`, the first ones: surveyed already

  // Nothing that was surveyed can stay.
  void StartOver() {
    old = kNone;
    kept = 0;
  }
};

// Applies a change of tile `id` to its stretches in canonical order, all of their frames surveyed.
// A stretch that grows at its end goes on; one that changes otherwise starts over; one without
// frames is gone. Frames that do not touch the tile are not of it.
void ApplyChange(const TileChange& change,
                 const TileId& id,
                 const MapProfile& profile,
                 std::vector<PlannedStretch>& plan);

}  // namespace atlas
