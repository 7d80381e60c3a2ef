#include "core/fusion/combination/bounded_choice.h"

#include <algorithm>

#include "core/base/small_sort.h"

namespace atlas {

std::size_t BoundedChoice::MoveLatestToFront(std::span<SegmentView> segments) {
  FindCandidates(segments);
  if (candidates_.empty()) {
    return segments.size();
  }
  SmallStableSort(candidates_.begin(), candidates_.end(),
                  [&](const Candidate& a, const Candidate& b) {
                    return IsChosenBefore(segments[a.index], segments[b.index]);
                  });
  Choose(segments);
  return MoveRestBack(segments);
}

// The segments of bands that may hold too many.
void BoundedChoice::FindCandidates(std::span<const SegmentView> segments) {
  const std::size_t limit = std::min(profile_.band_segments, profile_.band_vehicle_segments);
  candidates_.clear();
  if (segments.size() <= limit) {
    return;
  }
  bands_.clear();
  for (const SegmentView& segment : segments) {
    bands_.push_back(BandOf(segment, profile_.band_mm));
    ++counts_[Slot(bands_.back())];
  }
  for (std::size_t i = segments.size(); i-- > 0;) {  // later stretches are mostly later in time
    if (counts_[Slot(bands_[i])] > limit) {
      candidates_.push_back({bands_[i], static_cast<std::uint32_t>(i)});
    }
  }
  for (const std::int32_t band : bands_) {
    counts_[Slot(band)] = 0;
  }
}

void BoundedChoice::Choose(std::span<const SegmentView> segments) {
  for (const Candidate& candidate : candidates_) {
    chosen_[Slot(candidate.band)] = kNone;
  }
  for (std::uint32_t i = 0; i < candidates_.size(); ++i) {
    Candidate& candidate = candidates_[i];
    if (HasRoom(candidate, segments)) {
      std::uint32_t& last = chosen_[Slot(candidate.band)];
      candidate.counts = true;
      candidate.next = last;
      last = i;
    }
  }
}

bool BoundedChoice::HasRoom(const Candidate& candidate,
                            std::span<const SegmentView> segments) const {
  const std::uint32_t vehicle = segments[candidate.index].vehicle;
  std::uint32_t of_band = 0;
  std::uint32_t of_vehicle = 0;
  for (std::uint32_t i = chosen_[Slot(candidate.band)]; i != kNone; i = candidates_[i].next) {
    const Candidate& other = candidates_[i];
    if (other.band == candidate.band) {
      ++of_band;
      of_vehicle += segments[other.index].vehicle == vehicle ? 1u : 0u;
    }
  }
  return of_band < profile_.band_segments && of_vehicle < profile_.band_vehicle_segments;
}

std::size_t BoundedChoice::MoveRestBack(std::span<SegmentView> segments) {
  is_dropped_.assign(segments.size(), 0);
  for (const Candidate& candidate : candidates_) {
    is_dropped_[candidate.index] = candidate.counts ? 0 : 1;
  }
  std::size_t kept = 0;
  rest_.clear();
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (is_dropped_[i] != 0) {
      rest_.push_back(segments[i]);
    } else {
      segments[kept++] = segments[i];
    }
  }
  std::copy(rest_.begin(), rest_.end(), segments.begin() + static_cast<std::ptrdiff_t>(kept));
  return kept;
}

}  // namespace atlas
