// The paper's segment (III-C) in one cell: what one stretch of a session saw of one surface there,
// summed up. Everything that fusion needs of the observations behind it, whatever the other
// sessions say.
#pragma once

#include <cstdint>
#include <limits>

#include "core/fusion/segment/column_evidence.h"
#include "core/geometry/keyframe_cell.h"

namespace atlas {

struct alignas(64) Segment {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  // Eq. 3 in information form; altitudes are taken from `reference_mm` to stay small.
  std::int64_t weight = 0;
  std::int64_t moment = 0;
  std::int32_t reference_mm = 0;       // the first observation's altitude
  std::int32_t altitude_mm = 0;        // the representative's: the nearest observation's
  std::int32_t column_base = 0;        // lattice index of the column's lowest segment
  std::uint32_t last_frame = 0;        // of the stretch, the last that saw it
  std::uint32_t driven_frame = kNone;  // the last whose vehicle was there itself, while it holds
  std::uint32_t next = kNone;          // of the same cell
  std::uint16_t column_seen = 0;       // bit k: something was said about segment k of the column
  std::uint16_t observations = 0;      // saturating
  std::uint16_t distance_step = 0;     // the representative's
  std::int8_t occupancy = 0;           // evidence, units of ln(9)/64
  AltitudeSource source : 2 = AltitudeSource::kNone;  // the representative's
  bool is_strong : 1 = false;                         // some altitude was measured or interpolated
  bool is_used : 1 = false;                           // it was part of a layer when combined last
  bool is_revised : 1 = false;                        // it has changed since then
  ColumnLanes column{};
};
static_assert(sizeof(Segment) == 64);  // one line of a cache: it is read for every observation

}  // namespace atlas
