#include "core/fusion/combination/recent_drives.h"

#include <algorithm>

namespace atlas {

void RecentDrives::Hear(SegmentSay& say) {
  if (last_word_ == kNone) {
    return;
  }
  for (const SegmentSay& drive : drives_) {
    const bool is_recent = say.time_ms - drive.driven_ms <= hold_ms_;
    if (drive.session == say.session && drive.layer == say.layer && is_recent) {
      DropHits(drive, say);
    }
  }
  if (IsDrive(say)) {
    drives_.push_back(say);
  }
}

bool RecentDrives::IsDrive(const SegmentSay& say) const {
  return say.occupancy == last_word_ || HasValue(say.column, static_cast<std::int8_t>(last_word_));
}

void RecentDrives::DropHits(const SegmentSay& drive, SegmentSay& say) const {
  if (drive.occupancy == last_word_) {
    say.occupancy = std::min(say.occupancy, 0);
  }
  DropHitsWhere(drive.column, static_cast<std::int8_t>(last_word_),
                std::int64_t{say.column_base} - drive.column_base, say.column);
}

}  // namespace atlas
