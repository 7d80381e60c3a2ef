#include "core/fusion/segments.h"

#include <algorithm>
#include <cstdlib>

namespace atlas {
namespace {

bool AnyStrong(std::span<const Observation> observations) {
  return std::any_of(observations.begin(), observations.end(),
                     [](const Observation& o) { return o.is_strong(); });
}

// Whether `next`, the maker after `previous` in canonical order, begins a segment.
bool StartsSegment(const Observation& previous,
                   const Observation& next,
                   const FusionInput& input,
                   const MapProfile& profile) {
  const FusionFrame& a = input.frames[previous.frame];
  const FusionFrame& b = input.frames[next.frame];
  if (a.session != b.session || b.sequence - a.sequence > profile.sequence_gap) {
    return true;
  }
  const std::int64_t step_mm =
      std::abs(std::int64_t{next.altitude_mm} - std::int64_t{previous.altitude_mm});
  return profile.preset != FusionPreset::kPaper && step_mm >= profile.other_layer_mm;
}

}  // namespace

LayerMakers::LayerMakers(std::span<const Observation> observations, const MapProfile& profile)
    : all_(profile.preset == FusionPreset::kPaper || !AnyStrong(observations)) {}

void FindRepresentatives(std::span<const Observation> observations,
                         const LayerMakers& makers,
                         const FusionInput& input,
                         const MapProfile& profile,
                         std::vector<Representative>& representatives) {
  representatives.clear();
  const Observation* previous = nullptr;
  for (std::uint32_t i = 0; i < observations.size(); ++i) {
    const Observation& observation = observations[i];
    if (!makers.Contains(observation)) {
      continue;
    }
    if (previous == nullptr || StartsSegment(*previous, observation, input, profile)) {
      representatives.push_back({i, input.frames[observation.frame].session, 0});
    } else if (Representative& last = representatives.back();
               observation.distance_step < observations[last.observation].distance_step) {
      last.observation = i;  // of two equally near ones the lower sequence stays
    }
    previous = &observation;
  }
}

}  // namespace atlas
