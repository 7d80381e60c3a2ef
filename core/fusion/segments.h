// The paper's segments (III-C) in one cell: runs of one session's keyframes that see it, each with
// its representative, the nearest observation.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/fusion_input.h"
#include "core/fusion/observation.h"

namespace atlas {

struct Representative {
  std::uint32_t observation = 0;  // index into the cell's observations
  std::uint32_t session = 0;
  std::uint32_t layer = 0;  // its label by eq. 1, set later
};

// Which observations make layers: all in preset paper; else the strong ones where there are any,
// and the weak ones only among themselves.
class LayerMakers {
 public:
  LayerMakers(std::span<const Observation> observations, const MapProfile& profile);
  bool Contains(const Observation& observation) const { return all_ || observation.is_strong(); }

 private:
  bool all_;
};

// Representatives of all segments, in canonical order, into `representatives`.
void FindRepresentatives(std::span<const Observation> observations,
                         const LayerMakers& makers,
                         const FusionInput& input,
                         const MapProfile& profile,
                         std::vector<Representative>& representatives);

}  // namespace atlas
