#include "core/fusion/bounded_choice.h"

#include <algorithm>
#include <array>

#include "core/base/integer_math.h"
#include "core/base/small_sort.h"

namespace atlas {

void BoundedChoice::KeepLatest(std::vector<SegmentView>& segments) {
  const std::uint32_t limit =
      std::min<std::uint32_t>(profile_.band_segments, profile_.band_vehicle_segments);
  if (segments.size() <= limit) {
    return;
  }
  FindCandidates(segments, limit);
  if (candidates_.empty()) {
    return;
  }
  SmallStableSort(candidates_.begin(), candidates_.end(),
                  [&](const Candidate& a, const Candidate& b) {
                    return a.band != b.band ? a.band < b.band
                                            : IsPreferred(segments[a.index], segments[b.index]);
                  });
  counts_.assign(segments.size(), true);
  for (const Candidate& candidate : candidates_) {
    counts_[candidate.index] = false;
  }
  for (std::size_t begin = 0; begin < candidates_.size();) {
    std::size_t end = begin;
    while (end < candidates_.size() && candidates_[end].band == candidates_[begin].band) {
      ++end;
    }
    ChooseOfBand(std::span(candidates_).subspan(begin, end - begin), segments);
    begin = end;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (counts_[i]) {
      segments[kept++] = segments[i];
    }
  }
  segments.resize(kept);
}

bool BoundedChoice::IsPreferred(const SegmentView& a, const SegmentView& b) {
  return a.segment->is_strong != b.segment->is_strong ? a.segment->is_strong : WasSeenEarlier(b, a);
}

// The segments of bands that may hold more than `limit`: counted by their last bits, so that others
// may be taken for them.
void BoundedChoice::FindCandidates(const std::vector<SegmentView>& segments, std::uint32_t limit) {
  std::array<std::uint32_t, 64> counts{};
  candidates_.clear();
  for (std::uint32_t i = 0; i < segments.size(); ++i) {
    candidates_.push_back({FloorDiv(segments[i].segment->altitude_mm, profile_.band_mm), i});
    ++counts[static_cast<std::size_t>(candidates_.back().band) % counts.size()];
  }
  std::erase_if(candidates_, [&](const Candidate& c) {
    return counts[static_cast<std::size_t>(c.band) % counts.size()] <= limit;
  });
}

// `band` in order of preference; those that count come to stand at its front.
void BoundedChoice::ChooseOfBand(std::span<Candidate> band,
                                 const std::vector<SegmentView>& segments) {
  std::size_t chosen = 0;
  for (const Candidate& candidate : band) {
    const std::uint32_t vehicle = segments[candidate.index].vehicle;
    std::uint32_t of_vehicle = 0;
    for (const Candidate& other : band.first(chosen)) {
      of_vehicle += segments[other.index].vehicle == vehicle ? 1u : 0u;
    }
    if (chosen < profile_.band_segments && of_vehicle < profile_.band_vehicle_segments) {
      counts_[candidate.index] = true;
      band[chosen++] = candidate;
    }
  }
}

}  // namespace atlas
