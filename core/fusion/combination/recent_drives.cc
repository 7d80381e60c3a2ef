#include "core/fusion/combination/recent_drives.h"

#include <algorithm>

namespace atlas {

void RecentDrives::Hear(SegmentSay& say) {
  if (last_word_ == kNone) {
    return;
  }
  // Those that saw the layer last more than `hold_ms_` ago drove there before that.
  for (auto drive = drives_.rbegin();
       drive != drives_.rend() && say.time_ms - drive->time_ms <= hold_ms_; ++drive) {
    const bool is_recent = say.time_ms - drive->driven_ms <= hold_ms_;
    if (is_recent && drive->session == say.session && drive->layer == say.layer) {
      DropHits(*drive, say);
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
