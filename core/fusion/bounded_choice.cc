#include "core/fusion/bounded_choice.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/integer_math.h"

namespace atlas {
namespace {

struct Candidate {
  std::int64_t band = 0;
  std::uint32_t index = 0;
};

// Whether some band may hold more than `limit`: counted by its last bits, so that others may be
// taken for it.
bool MayExceed(const std::vector<Candidate>& candidates, std::uint32_t limit) {
  std::array<std::uint32_t, 64> counts{};
  return std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
    return ++counts[static_cast<std::size_t>(c.band) % counts.size()] > limit;
  });
}

// Those of one band, latest first: keeps those that count, and returns how many.
std::size_t KeepOfBand(std::span<Candidate> band,
                       const std::vector<SegmentView>& segments,
                       const MapProfile& profile) {
  std::size_t kept = 0;
  for (const Candidate& candidate : band) {
    const auto of_vehicle = static_cast<std::uint32_t>(
        std::count_if(band.begin(), band.begin() + static_cast<std::ptrdiff_t>(kept),
                      [&](const Candidate& other) {
                        return segments[other.index].vehicle == segments[candidate.index].vehicle;
                      }));
    if (kept < profile.band_segments && of_vehicle < profile.band_vehicle_segments) {
      band[kept++] = candidate;
    }
  }
  return kept;
}

}  // namespace

void KeepLatestSegments(const MapProfile& profile, std::vector<SegmentView>& segments) {
  const std::uint32_t limit =
      std::min<std::uint32_t>(profile.band_segments, profile.band_vehicle_segments);
  if (segments.size() <= limit) {
    return;
  }
  std::vector<Candidate> candidates;
  candidates.reserve(segments.size());
  for (std::uint32_t i = 0; i < segments.size(); ++i) {
    candidates.push_back({FloorDiv(segments[i].segment->altitude_mm, profile.band_mm), i});
  }
  if (!MayExceed(candidates, limit)) {
    return;
  }
  std::sort(candidates.begin(), candidates.end(), [&](const Candidate& a, const Candidate& b) {
    return a.band != b.band ? a.band < b.band
                            : WasSeenEarlier(segments[b.index], segments[a.index]);
  });
  std::vector<bool> counts(segments.size(), false);
  for (std::size_t begin = 0; begin < candidates.size();) {
    std::size_t end = begin;
    while (end < candidates.size() && candidates[end].band == candidates[begin].band) {
      ++end;
    }
    const auto band = std::span(candidates).subspan(begin, end - begin);
    for (const Candidate& c : band.first(KeepOfBand(band, segments, profile))) {
      counts[c.index] = true;
    }
    begin = end;
  }
  std::size_t next = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (counts[i]) {
      segments[next++] = segments[i];
    }
  }
  segments.resize(next);
}

}  // namespace atlas
