// A segment beside those of other stretches in one cell.
#pragma once

#include <cstdint>

#include "core/fusion/segment/segment.h"

namespace atlas {

struct SegmentView {
  Segment* segment = nullptr;
  std::int64_t last_time_ms = 0;  // of the keyframe that saw it last
  std::int64_t driven_ms = 0;     // of its driven_frame, if it has one
  std::uint32_t stretch = 0;      // its place in canonical order
  std::uint32_t session = 0;      // FusionStretch's number
  std::uint32_t vehicle = 0;      // equal for equal vehicle names
};

// By the keyframe that saw it last: its time, then vehicle, session and sequence.
inline bool WasSeenEarlier(const SegmentView& a, const SegmentView& b) {
  if (a.last_time_ms != b.last_time_ms) {
    return a.last_time_ms < b.last_time_ms;
  }
  return a.stretch != b.stretch ? a.stretch < b.stretch
                                : a.segment->last_frame < b.segment->last_frame;
}

// floor(altitude / band_mm): its band of altitude, in 32 bits since it is asked of every segment.
inline std::int32_t BandOf(const SegmentView& view, std::int32_t band_mm) {
  const std::int32_t altitude_mm = view.segment->altitude_mm;
  return altitude_mm / band_mm - (altitude_mm % band_mm < 0 ? 1 : 0);
}

}  // namespace atlas
