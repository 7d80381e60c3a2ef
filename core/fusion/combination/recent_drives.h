// Where a vehicle itself was in one cell, and for how long that keeps out what later stretches of
// its session see there: whatever it is follows the vehicle.
#pragma once

#include <cstdint>
#include <vector>

#include "core/fusion/segment/column_evidence.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// What a segment says of its layer.
struct SegmentSay {
  std::int64_t time_ms = 0;    // of the keyframe that saw it last
  std::int64_t driven_ms = 0;  // of the last whose vehicle was there itself, if one was
  std::uint32_t session = 0;
  std::uint32_t layer = 0;
  int occupancy = 0;
  std::int32_t column_base = 0;
  ColumnLanes column{};
};

// Reused from cell to cell.
class RecentDrives {
 public:
  explicit RecentDrives(const MapProfile& profile)
      : last_word_(profile.driven_clamp > profile.stretch_clamp ? -profile.driven_clamp : kNone),
        hold_ms_(profile.driven_hold_ms) {}

  void Clear() { drives_.clear(); }
  // Drops the hits of `say` where the vehicle of its session was up to `driven_hold_ms` ago, and
  // remembers where it is now. By time.
  void Hear(SegmentSay& say);

 private:
  static constexpr int kNone = 0;

  bool IsDrive(const SegmentSay& say) const;
  void DropHits(const SegmentSay& drive, SegmentSay& say) const;

  int last_word_;  // a stretch's evidence where its vehicle was, or kNone
  std::int64_t hold_ms_;
  std::vector<SegmentSay> drives_;
};

}  // namespace atlas
