#include "core/fusion/bounded_choice.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/base/integer_math.h"

namespace atlas {
namespace {

std::int64_t BandOf(const SegmentView& view, const MapProfile& profile) {
  return FloorDiv(view.segment->altitude_mm, profile.band_mm);
}

// Whether the band has room for `view` beside those that count already.
bool HasRoom(const SegmentView& view,
             const std::vector<SegmentView>& segments,
             const std::vector<std::uint32_t>& kept,
             const MapProfile& profile) {
  const std::int64_t band = BandOf(view, profile);
  std::uint32_t of_all = 0;
  std::uint32_t of_vehicle = 0;
  for (const std::uint32_t i : kept) {
    if (BandOf(segments[i], profile) == band) {
      ++of_all;
      of_vehicle += segments[i].vehicle == view.vehicle ? 1u : 0u;
    }
  }
  return of_all < profile.band_segments && of_vehicle < profile.band_vehicle_segments;
}

}  // namespace

void KeepLatestSegments(const MapProfile& profile, std::vector<SegmentView>& segments) {
  if (segments.size() <= profile.band_vehicle_segments &&
      segments.size() <= profile.band_segments) {
    return;
  }
  std::vector<std::uint32_t> latest_first(segments.size());
  std::iota(latest_first.begin(), latest_first.end(), 0u);
  std::sort(latest_first.begin(), latest_first.end(), [&](std::uint32_t a, std::uint32_t b) {
    return WasSeenEarlier(segments[b], segments[a]);
  });
  std::vector<std::uint32_t> kept;
  for (const std::uint32_t i : latest_first) {
    if (HasRoom(segments[i], segments, kept, profile)) {
      kept.push_back(i);
    }
  }
  std::sort(kept.begin(), kept.end());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    segments[i] = segments[kept[i]];
  }
  segments.resize(kept.size());
}

}  // namespace atlas
