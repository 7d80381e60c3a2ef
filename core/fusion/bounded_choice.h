// Preset bounded: of each band of altitude in a cell, only the segments that were seen last count,
// so that what a cell costs does not grow with the passes. Guesses never push out what was
// measured.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/segment_view.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// Reused from cell to cell.
class BoundedChoice {
 public:
  // `profile` must outlive the choice.
  explicit BoundedChoice(const MapProfile& profile) : profile_(profile) {}

  // Removes what does not count: strong ones first and of each kind the latest, a segment counts
  // while its band holds fewer than `band_segments`, and fewer than `band_vehicle_segments` of its
  // vehicle. The order is kept.
  void KeepLatest(std::vector<SegmentView>& segments);

 private:
  struct Candidate {
    std::int64_t band = 0;
    std::uint32_t index = 0;
  };

  void FindCandidates(const std::vector<SegmentView>& segments, std::uint32_t limit);
  static bool IsPreferred(const SegmentView& a, const SegmentView& b);
  void ChooseOfBand(std::span<Candidate> band, const std::vector<SegmentView>& segments);

  const MapProfile& profile_;
  std::vector<Candidate> candidates_;
  std::vector<bool> counts_;  // by segment
};

}  // namespace atlas
