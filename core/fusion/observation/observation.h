// What one keyframe says about one cell of the map.
#pragma once

#include <cstdint>

#include "core/geometry/keyframe_cell.h"

namespace atlas {

struct Observation {
  std::int32_t altitude_mm = 0;  // world frame
  std::int32_t column_base = 0;  // world lattice index of the lowest nibble's segment, if any
  std::uint64_t column = 0;      // the keyframe's nibbles; 0: none
  std::uint16_t distance_step = 0;
  AltitudeSource source = AltitudeSource::kNone;
  Occupancy occupancy = Occupancy::kUnknown;

  // Ground was measured at or around the cell, not carried over from beside it.
  bool is_strong() const { return source != AltitudeSource::kExtrapolated; }
};

}  // namespace atlas
